"""Preset ``smith``: a given number of photos, moved until they reconstruct the most.

An implementation of our own of the method of Smith, Moehrle, Goesele and Heidrich, "Aerial Path
Planning for Urban Scene Reconstruction: A Continuous Optimization Method and Benchmark" (2018),
to compare with: regular photos from above are moved one by one by the downhill simplex method and
turned by a histogram over the directions below, while the others stay; photos that are far apart
are moved at the same time.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from planner.airspace.airspace import Airspace
from planner.config import ViewpointSettings
from planner.geometry.arrays import Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.frustum import elevation_range, in_frustum
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, parallax_weight
from planner.viewpoints.sight import SightRule
from planner.viewpoints.smith_batch import BatchJob, Moves, move_views
from planner.viewpoints.smith_sight import Album, Eye, Seen
from planner.viewpoints.smith_space import FreeBalls, free_balls
from planner.viewpoints.viewpoints import Viewpoints
from solvers.pairs import chord_table

_HEIGHT = 0.4  # of the reference distance: how far above the scene the photos start
_RIM = 0.3  # of the reference distance: how far beyond the scene they start
_STEP = 0.2  # of the reference distance: the first step of the first round
_APART = 1.0  # of the reference distance: photos farther apart than this are independent
_EVALUATIONS = 24  # places that a photo tries in a round
_TOGETHER = 16  # photos of one job
_PER_AREA = 25.0  # photos on a square of the GSD's distance, where no number is given


def smith_viewpoints(
    positions: Floats,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    reference: float,
    settings: ViewpointSettings,
    map: Callable[..., Any] = map,  # noqa: A002 - it is a map
    airspace: Airspace | None = None,
) -> Viewpoints:
    """Place a given number of photos by continuous optimisation.

    What is maximised is the sum over the samples of their reconstructability, as far as it counts
    (``target``). In a round each photo moves once; photos at least the reference distance apart
    move together, spread by ``map``. The result does not depend on who runs it when.

    Parameters
    ----------
    positions
        Free positions, shape (V, 3), metres, local frame.
    samples, caster, camera
        What is to be photographed, what may be in the way, and the field of view.
    reference
        Distance at which a photo is worth nothing, metres.
    settings
        ``views``, ``rounds``, ``target`` and ``aim_directions``.
    map
        Runs :func:`~planner.viewpoints.smith_batch.move_views`; anything like :func:`map`.
    airspace
        Where photos may be taken between the positions; without it they stay on them.

    Returns
    -------
    viewpoints
        Of kind ``smith``, all in free space; as many as wanted, or none without any position.

    """
    if not len(positions) or not len(samples):
        none = np.empty(0)
        return Viewpoints(np.empty((0, 3)), none, none, (), np.empty(0, dtype=np.int64))
    low, high = elevation_range(camera)
    rule = SightRule(0.0, reference, GRAZING, low=low, high=high, sectors=1)
    crowd = _Crowd(
        Eye(samples, caster, rule),
        free_balls(positions, airspace),
        camera,
        settings=settings,
        count=settings.views or wanted_views(samples, reference),
    )
    for turn in range(settings.rounds):
        for batch in far_apart(crowd.places, _APART * reference):
            jobs = list(crowd.jobs(batch, size=_STEP * reference * 0.7**turn))
            for moves in list(map(move_views, jobs)):
                crowd.accept(moves)
    return crowd.viewpoints()


def wanted_views(samples: SurfaceSamples, reference: float) -> int:
    """Number of photos from the area of the samples, so that 433 suit the benchmark scene."""
    area = len(samples) * samples.radius**2 / 0.7  # density of Poisson-disk samples
    return max(4, round(_PER_AREA * area / (0.5 * reference) ** 2))


def far_apart(places: Floats, distance: float) -> Iterator[Ints]:
    """Split places, (n, 3), into few groups with no two closer than a distance."""
    left = np.arange(len(places))
    while len(left):
        taken: list[int] = []
        for row in left:
            gaps = places[taken] - places[row]
            if (np.einsum("ij,ij->i", gaps, gaps) >= distance**2).all():
                taken.append(int(row))
        yield np.array(taken)
        left = np.setdiff1d(left, taken)


class _Crowd:
    """All photos while they are moved."""

    def __init__(
        self, eye: Eye, space: FreeBalls, camera: Camera, *, settings: ViewpointSettings, count: int
    ) -> None:
        self._eye, self._space, self._camera, self._settings = eye, space, camera, settings
        self._table = chord_table(parallax_weight)
        self._yaw, self._pitch = aim_directions(settings.aim_directions, camera)
        self.places = regular_places(eye.samples.xyz, space, count, reference=eye.rule.d_max)
        self._aim = np.full(count, int(np.argmin(self._pitch)))
        self._seen = self._photograph(self.places, self._aim)

    def _photograph(self, places: Floats, aim: Ints) -> Seen:
        """What the pictures taken at places hold."""
        seen = self._eye.see(places)
        turn, tilt = self._yaw[aim][seen.owner], self._pitch[aim][seen.owner]
        return seen.rows(in_frustum(-seen.sight[:, :3], turn, tilt, self._camera))

    def jobs(self, batch: Ints, *, size: float) -> Iterator[BatchJob]:
        """Jobs that move some photos while all others stay."""
        from planner.viewpoints.smith_kernels import own_share, sums

        album, cap = Album.of(self._seen, len(self._eye.samples)), self._settings.target
        total = sums(album.starts, album.sight, self._table)
        for first in range(0, len(batch), _TOGETHER):
            views = batch[first : first + _TOGETHER]
            given = [
                own_share(view, album.starts, album.owner, album.sight, self._table)
                for view in views
            ]
            base = np.maximum(total - np.array(given), 0.0)
            worth = (np.minimum(total, cap) - np.minimum(base, cap)).sum(axis=1)
            yield BatchJob(
                *(self._eye, self._space, self._camera, album, views, self.places[views]),
                *(base, worth, cap, size, _EVALUATIONS, self._settings.aim_directions),
                self._table,
            )

    def accept(self, moves: Moves) -> None:
        """Take over better poses."""
        if not len(moves.views):
            return
        self.places[moves.views], self._aim[moves.views] = moves.places, moves.aims
        fresh = self._photograph(moves.places, moves.aims)
        old = self._seen.rows(~np.isin(self._seen.owner, moves.views))
        self._seen = Seen(
            np.concatenate([old.owner, moves.views[fresh.owner]]),
            np.concatenate([old.sample, fresh.sample]),
            np.concatenate([old.sight, fresh.sight]),
        )

    def viewpoints(self) -> Viewpoints:
        """The photos as they are now; each one's target is the sample nearest to its axis."""
        yaw, pitch = self._yaw[self._aim], self._pitch[self._aim]
        count = len(self.places)
        views = Viewpoints(self.places, yaw, pitch, ("smith",) * count, np.full(count, -1))
        along = -np.einsum("ij,ij->i", self._seen.sight[:, :3], views.directions[self._seen.owner])
        order = np.lexsort((-along, self._seen.owner))
        owner, first = np.unique(self._seen.owner[order], return_index=True)
        targets = np.full(count, -1)
        targets[owner] = self._seen.sample[order][first]
        return Viewpoints(views.positions, yaw, pitch, views.kind, targets)


def regular_places(xyz: Floats, space: FreeBalls, count: int, *, reference: float) -> Floats:
    """Free places on a level lattice above the scene, following its height, shape (count, 3).

    Parameters
    ----------
    xyz
        Samples of the scene, shape (S, 3), metres.
    space
        Where photos may be taken.
    count
        Number of places, at least 1.
    reference
        Distance at which a photo is worth nothing, metres.

    """
    low, high = xyz.min(axis=0) - _RIM * reference, xyz.max(axis=0) + _RIM * reference
    width, depth = (high - low)[:2]
    rows = max(1, round(math.sqrt(count * depth / width)))
    per_row = np.full(rows, count // rows)
    per_row[np.linspace(0, rows - 1, count % rows).astype(np.int64)] += 1
    flat = np.array(
        [
            (low[0] + (i + 0.5) / many * width, low[1] + (row + 0.5) / rows * depth)
            for row, many in enumerate(per_row)
            for i in range(many)
        ]
    )
    top = _highest(xyz, flat, 0.5 * width / max(1, count // rows))
    return space.nearest(np.column_stack([flat, top + _HEIGHT * reference]))


def _highest(xyz: Floats, flat: Floats, radius: float) -> Floats:
    """Height of the highest sample within a radius of each level place, or of the nearest one."""
    from scipy.spatial import cKDTree

    tree = cKDTree(xyz[:, :2])
    near = tree.query_ball_point(flat, radius)
    nearest = np.asarray(tree.query(flat)[1])
    return np.array([xyz[rows or [one], 2].max() for rows, one in zip(near, nearest, strict=True)])
