"""Move and turn photos that do not depend on each other, while all others stay."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Floats, Ints
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.eye import Album, Eye, Hunger
from planner.viewpoints.free_balls import FreeBalls
from planner.viewpoints.frustum import camera_axes, picture_bounds
from planner.viewpoints.sight import SightRule
from planner.viewpoints.simplex import Search, climb


@dataclass(frozen=True, slots=True, eq=False)
class Wish:
    """What photos are moved for.

    The worth of a sample is its reconstructability as far as ``target``, plus ``sharp_worth`` for
    each sharp photo that it wants.

    Parameters
    ----------
    target
        More reconstructability of each sample than this is worth nothing, shape (S,).
    want
        Sharp photos that each sample wants, shape (S,).
    sharp_worth
        As above.
    sharp
        Which photo of a sample is sharp; without it, each is.

    """

    target: Floats
    want: Ints
    sharp_worth: float = 0.0
    sharp: SightRule | None = None

    def limits(self, reference: float) -> Floats:
        """Reference distance, and of a sharp photo least cosine, farthest distance and reach."""
        rule = self.sharp
        if rule is None:
            return np.array([reference, -1.0, math.inf, math.inf])
        return np.array([reference, math.cos(rule.max_incidence), rule.d_max, rule.reach])

    def hungry(self, value: Floats, sharp: Ints) -> Bools:
        """Which samples want more; any shape."""
        return np.asarray((value < self.target) | (sharp < self.want))

    def worth(self, value: Floats, sharp: Ints, rows: Ints | slice = slice(None)) -> Floats:
        """Worth of samples, or some rows of them, with these values and sharp photos."""
        fine = self.sharp_worth * np.minimum(sharp, self.want[rows])
        return np.asarray(np.minimum(value, self.target[rows]) + fine)


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
    base, base_sharp
        What the other views give to each sample: reconstructability, and sharp photos; (B, S).
    worth
        What each view adds to it now, shape (B,).
    wish
        What counts.
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
    base_sharp: NDArray[np.int64]
    worth: Floats
    wish: Wish
    size: float
    evaluations: int
    directions: int
    table: Floats

    @cached_property
    def hungry(self) -> Bools:
        """Which samples want more than the other views give, shape (B, S)."""
        return self.wish.hungry(self.base, self.base_sharp)

    @cached_property
    def rows(self) -> Ints:
        """Samples of which any wants more, ascending."""
        return np.flatnonzero(self.hungry.any(axis=0))


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
    from planner.viewpoints.move_kernels import best_aims, gains

    album, wish = job.album, job.wish
    seen = job.eye.see(places, Hunger(job.hungry, job.rows, member))
    gain = gains(
        *(seen.owner, seen.sample, seen.sight, member, job.views, job.base, job.base_sharp),
        *(wish.want, wish.target, wish.sharp_worth, wish.limits(job.eye.reference)),
        *(album.starts, album.owner, album.sight, job.table),
    )
    indptr = np.searchsorted(seen.owner, np.arange(len(places) + 1)).astype(np.int64)
    axes = camera_axes(*aim_directions(job.directions, job.camera))
    bounds = np.array(picture_bounds(job.camera))
    rays = np.ascontiguousarray(-seen.sight[:, :3])
    return best_aims(rays, gain, indptr, axes, bounds)
