"""Poses beside the chosen ones, off the grid: places and aims to go on with."""

import math

import numpy as np

from planner.geometry.angles import direction, yaw_pitch
from planner.geometry.arrays import Floats
from planner.viewpoints.camera import Camera
from planner.viewpoints.free_balls import FreeBalls
from planner.viewpoints.pool import Pool


def poses_beside(
    chosen: Pool,
    room: FreeBalls,
    camera: Camera,
    *,
    step: float,
    turn: float,
    copies: int,
    seed: np.random.SeedSequence,
) -> tuple[Floats, Floats, Floats]:
    """Move and turn each chosen pose a little, several times, within the free space.

    Parameters
    ----------
    chosen
        The poses, K of them.
    room
        Where it is known to be free.
    camera
        Whose gimbal limits the pitch.
    step
        Largest move, metres.
    turn
        Largest turn of the aim, radians.
    copies
        Poses made of each.
    seed
        Of the moves and turns.

    Returns
    -------
    positions, yaw_deg, pitch_deg
        Shapes (n, 3), (n,) and (n,) with n = K ``copies``.

    """
    rng = np.random.default_rng(seed)
    count = len(chosen) * copies
    moved = np.repeat(chosen.positions, copies, axis=0) + step * _in_ball(rng, count)
    look = np.repeat(direction(chosen.yaw_deg, chosen.pitch_deg), copies, axis=0)
    look = look + math.sin(turn) * _in_ball(rng, count)
    yaw, pitch = yaw_pitch(look)
    return room.nearest(moved), yaw, pitch.clip(camera.pitch_min_deg, camera.pitch_max_deg)


def _in_ball(rng: np.random.Generator, count: int) -> Floats:
    """Even spread of points in the unit ball, shape (count, 3)."""
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return np.asarray(way * np.cbrt(rng.random((count, 1))))
