"""What sorties would take if every way were straight: what is thought before they are flown."""

import numpy as np

from planner.config import SortieSettings
from planner.flight.limits import Limits
from planner.flight.timing import SHORTEST
from planner.geometry.angles import circular_difference_deg
from planner.geometry.arrays import Floats
from planner.viewpoints.viewpoints import Viewpoints


def usable_seconds(settings: SortieSettings) -> float:
    """Endurance without the reserve, seconds."""
    return settings.endurance_seconds * (1.0 - settings.reserve)


def straight_legs(views: Viewpoints, limits: Limits) -> Floats:
    """Least seconds from photo to photo, the second included, if flown straight, shape (V, V)."""
    spots = views.positions
    metres = np.linalg.norm(spots[:, None] - spots[None], axis=2)
    yaw = np.abs(circular_difference_deg(views.yaw_deg[:, None], views.yaw_deg[None]))
    pitch = np.abs(views.pitch_deg[:, None] - views.pitch_deg[None])
    turn = np.maximum(yaw / limits.yaw_rate_deg, pitch / limits.gimbal_rate_deg)
    rest = limits.settle_seconds if limits.stop else 2.0 * limits.hold_seconds
    way = straight_seconds(metres, limits)
    if limits.stop:
        return np.asarray(rest + np.maximum(np.maximum(way, turn), SHORTEST))
    return np.asarray(np.maximum(np.maximum(way, turn + rest), SHORTEST))


def straight_seconds(metres: Floats, limits: Limits) -> Floats:
    """Seconds of straight ways from rest to rest, or the least where photos are flown through."""
    speed, a = limits.speed, limits.acceleration
    if not limits.stop:
        return np.asarray(metres / speed)
    short = metres * a < speed**2
    return np.asarray(np.where(short, 2.0 * np.sqrt(metres / a), metres / speed + speed / a))
