"""What to say of a photo that no sortie can take."""

import math

from planner.config import SortieSettings
from planner.errors import Unattainable
from planner.geometry.arrays import Floats
from planner.sorties.problem import ENDS
from planner.sorties.thought import usable_seconds


def refuse_waypoints(settings: SortieSettings) -> None:
    """Refuse a limit on waypoints that not even one photo keeps."""
    most = settings.most_waypoints
    if most is not None and most < ENDS:
        raise Unattainable(
            f"sorties.most_waypoints = {most}: a sortie of one photo has {ENDS}; raise it"
        )


def too_far(spot: Floats, seconds: float, settings: SortieSettings) -> Unattainable:
    """A photo alone takes longer than a sortie may: names the endurance that it needs."""
    if math.isinf(seconds):
        return unreachable(spot)
    needed = math.ceil(seconds / (1.0 - settings.reserve))
    return Unattainable(
        f"sorties.endurance_seconds = {settings.endurance_seconds:g}: the photo at {_at(spot)} "
        f"alone takes {seconds:.0f} s from lift-off to landing, and a reserve of "
        f"{settings.reserve:g} leaves {usable_seconds(settings):.0f} s; {needed} s are needed"
    )


def unreachable(spot: Floats) -> Unattainable:
    """No safe way was found to a photo."""
    return Unattainable(
        f"sorties.stations: no safe way was found from any station to the photo at {_at(spot)}; "
        "move a station or add one"
    )


def too_winding(spot: Floats, needed: int, settings: SortieSettings) -> Unattainable:
    """The way to a photo alone has more waypoints than a sortie may."""
    return Unattainable(
        f"sorties.most_waypoints = {settings.most_waypoints}: the photo at {_at(spot)} alone "
        f"needs {needed}; raise it"
    )


def _at(spot: Floats) -> str:
    x, y, z = spot
    return f"({x:.1f}, {y:.1f}, {z:.1f})"
