"""Move and turn views that do not depend on each other (preset ``smith``)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.frustum import camera_axes, picture_bounds
from planner.viewpoints.smith_sight import Album, Eye
from planner.viewpoints.smith_simplex import Search, climb
from planner.viewpoints.smith_space import FreeBalls


@dataclass(frozen=True, eq=False)
class BatchJob:
    """Views to be moved while all others stay.

    Parameters
    ----------
    eye, space, camera
        What can be seen from a place, where places are free, and the field of view.
    album
        What all views see now.
    views
        The views to be moved, shape (B,).
    places
        Where they are, shape (B, 3), metres.
    base
        What the other views give to each sample, shape (B, S).
    worth
        What each view adds to it now, shape (B,).
    cap
        More reconstructability than this is worth nothing.
    size
        First step of the search, metres.
    evaluations
        Places that each search looks at.
    directions
        Bins of the histogram over the directions of the gimbal.
    table
        Weight of a pair of rays by their chord.

    """

    eye: Eye
    space: FreeBalls
    camera: Camera
    album: Album
    views: Ints
    places: Floats
    base: Floats
    worth: Floats
    cap: float
    size: float
    evaluations: int
    directions: int
    table: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
    """Better poses of some views.

    Parameters
    ----------
    views
        Which views, shape (n,).
    places
        Where they go, shape (n, 3), metres.
    aims
        Where they look, as the row of the direction, shape (n,).

    """

    views: Ints
    places: Floats
    aims: Ints


def move_views(job: BatchJob) -> Moves:
    """Search for a better place of each view, with the best aim there."""
    searches = [climb(at, size=job.size, evaluations=job.evaluations) for at in job.places]
    found = _climb_together(job, searches)
    places = np.array([at for at, _ in found]).reshape(-1, 3)
    aims, values = _look(job, places, np.arange(len(places)))
    better = np.flatnonzero(values > job.worth + 1e-9)
    return Moves(job.views[better], places[better], aims[better])


def _climb_together(job: BatchJob, searches: Sequence[Search]) -> list[tuple[Floats, float]]:
    """Run all searches step by step, so that each step casts its rays at once."""
    asked = {row: next(search) for row, search in enumerate(searches)}
    found: dict[int, tuple[Floats, float]] = {}
    while asked:
        member = np.repeat(list(asked), [len(points) for points in asked.values()])
        places = job.space.nearest(np.concatenate(list(asked.values())))
        values = _look(job, places, member)[1]
        for row in list(asked):
            mine = member == row
            try:
                asked[row] = searches[row].send((places[mine], values[mine]))
            except StopIteration as done:
                found[row] = done.value
                del asked[row]
    return [found[row] for row in range(len(searches))]


def _look(job: BatchJob, places: Floats, member: Ints) -> tuple[Ints, Floats]:
    """Best aim at each place for the view that may move there, and what it would add."""
    from planner.viewpoints.smith_kernels import best_aims, gains

    album = job.album
    seen = job.eye.see(places, (job.base < job.cap)[member])
    gain = gains(
        *(seen.owner, seen.sample, seen.sight, member, job.views, job.base, job.cap),
        *(album.starts, album.owner, album.sight, job.table),
    )
    indptr = np.searchsorted(seen.owner, np.arange(len(places) + 1)).astype(np.int64)
    axes = camera_axes(*aim_directions(job.directions, job.camera))
    bounds = np.array(picture_bounds(job.camera))
    rays = np.ascontiguousarray(-seen.sight[:, :3])
    return best_aims(rays, gain, indptr, axes, bounds)
