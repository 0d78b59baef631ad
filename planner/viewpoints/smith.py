"""Preset ``smith``: a given number of photos, moved until they reconstruct the most.

An implementation of our own of the method of Smith, Moehrle, Goesele and Heidrich, "Aerial Path
Planning for Urban Scene Reconstruction: A Continuous Optimization Method and Benchmark" (2018),
to compare with: regular photos from above are moved one by one by the downhill simplex method and
turned by a histogram over the directions below, while the others stay; photos that are far apart
are moved at the same time.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from planner.airspace.airspace import Airspace
from planner.config import FLIGHT_MARGIN, ViewpointSettings
from planner.geometry.arrays import Floats
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.crowd import Crowd
from planner.viewpoints.eye import Eye
from planner.viewpoints.free_balls import FreeBalls, free_balls
from planner.viewpoints.frustum import elevation_range
from planner.viewpoints.moves import Wish
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints

_HEIGHT = 0.4  # of the reference distance: how far above the scene the photos start
_RIM = 0.3  # of the reference distance: how far beyond the scene they start
_STEP = 0.2  # of the reference distance: the first step of the first round
_EVALUATIONS = 24  # places that a photo tries in a round
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
    margin: float = FLIGHT_MARGIN,
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
        Runs :func:`~planner.viewpoints.moves.move_views`; anything like :func:`map`.
    airspace
        Where photos may be taken between the positions; without it they stay on them.
    margin
        What the flight keeps beyond ``d_min``, and from zones, metres.

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
    count = settings.views or wanted_views(samples, reference)
    space = free_balls(positions, airspace, margin=margin)
    start = regular_places(samples.xyz, space, count, reference=reference)
    yaw, pitch = aim_directions(settings.aim_directions, camera)
    down = np.full(count, int(np.argmin(pitch)))
    crowd = Crowd(
        *(start, yaw[down], pitch[down]),
        eye=Eye(samples, caster, rule, reference),
        space=space,
        camera=camera,
        wish=Wish(np.full(len(samples), settings.target), np.zeros(len(samples), dtype=np.int64)),
        directions=settings.aim_directions,
    )
    for turn in range(settings.rounds):
        step = _STEP * reference * 0.7**turn
        crowd.move(step=step, evaluations=_EVALUATIONS, map=map)
    return _viewpoints(crowd)


def wanted_views(samples: SurfaceSamples, reference: float) -> int:
    """Number of photos from the area of the samples, so that 433 suit the benchmark scene."""
    area = len(samples) * samples.radius**2 / 0.7  # density of Poisson-disk samples
    return max(4, round(_PER_AREA * area / (0.5 * reference) ** 2))


def _viewpoints(crowd: Crowd) -> Viewpoints:
    """The photos as they are now; each one's target is the sample nearest to its axis."""
    count, seen = len(crowd.positions), crowd.seen
    poses = (crowd.positions, crowd.yaw_deg, crowd.pitch_deg, ("smith",) * count)
    views = Viewpoints(*poses, np.full(count, -1))
    along = -np.einsum("ij,ij->i", seen.sight[:, :3], views.directions[seen.owner])
    order = np.lexsort((-along, seen.owner))
    owner, first = np.unique(seen.owner[order], return_index=True)
    targets = np.full(count, -1)
    targets[owner] = seen.sample[order][first]
    return Viewpoints(*poses, targets)


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
