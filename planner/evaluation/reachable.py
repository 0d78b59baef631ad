"""Which samples any photos could reconstruct: the same answer for every way of choosing them."""

import numpy as np

from planner.airspace.candidates import candidate_positions
from planner.attempts import Prior
from planner.geometry.arrays import Bools, Floats
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.frustum import camera_axes, picture_bounds
from planner.viewpoints.pairs import visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, parallax_weight
from planner.viewpoints.sight import SightRule
from solvers.pairs import PairCoverProblem, chord_table

DIRECTIONS = 62
"""Directions that a camera looks to from every position of the evaluation grid."""
POSITIONS = 3_000
"""Most positions of the evaluation grid."""


def evaluation_grid(place: Prior) -> Floats:
    """Free positions of the fixed grid, shape (n, 3), metres."""
    grid = candidate_positions(
        place.airspace,
        box=place.scene.box,
        voxel=place.scale.voxel,
        limit=POSITIONS,
        margin=place.config.flight.margin,
    )
    return grid.positions


def reachable(
    place: Prior, samples: SurfaceSamples, *, positions: Floats | None = None, target: float = 3.0
) -> Bools:
    """Tell which samples have a reconstructability of ``target`` if every pose takes a photo.

    Parameters
    ----------
    place
        Surface, camera and free space.
    samples
        Samples of its surface.
    positions
        Where photos are taken, in all of 62 directions; without them the evaluation grid.
    target
        Wanted reconstructability.

    Returns
    -------
    reachable
        Shape (S,).

    """
    from scipy.sparse import csr_array

    positions = evaluation_grid(place) if positions is None else positions
    rule = SightRule(0.0, place.reference, GRAZING, sectors=1)
    pairs = visible_pairs(positions, samples, RayCaster(place.surface.mesh), rule)
    rays = samples.xyz[pairs.sample] - positions[pairs.position]
    seen = np.flatnonzero(in_any_picture(rays, place.camera))
    counts = np.bincount(pairs.position[seen], minlength=len(positions))
    indptr = np.concatenate([[0], np.cumsum(counts)])
    ones, shape = np.ones(len(seen), dtype=np.int8), (len(positions), len(samples))
    problem = PairCoverProblem(
        csr_array((ones, pairs.sample[seen], indptr), shape=shape),
        -rays[seen] / np.linalg.norm(rays[seen], axis=1, keepdims=True),
        1.0 - pairs.distance[seen] / place.reference,
        pairs.cosine[seen],
        weights=chord_table(parallax_weight),
        target=target,
    )
    return np.array(problem.reachable)


def in_any_picture(rays: Floats, camera: Camera) -> Bools:
    """Tell which rays, (n, 3), from a camera are in its picture for one of the directions."""
    yaw, pitch = aim_directions(DIRECTIONS, camera)
    west, east, south, north = picture_bounds(camera)
    found = np.zeros(len(rays), dtype=np.bool_)
    for axes in camera_axes(yaw, pitch):  # few
        left = np.flatnonzero(~found)
        right, up, depth = axes @ rays[left].T
        inside = (depth > 0.0) & (west * depth <= right) & (right <= east * depth)
        found[left] = inside & (south * depth <= up) & (up <= north * depth)
    return found
