"""What keeps samples from being photographed."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.airspace.airspace import Airspace
from planner.geometry.arrays import Bools, Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.pairs import VisiblePairs, visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule

_TILTS = (0.0, 0.35, 0.7, 0.95)  # of the largest incidence
_TURNS = 12
_REACHES = (0.05, 0.5, 0.95)  # between the closest and the farthest distance
_BLOCK = 2_000  # samples probed together


def hindrances(
    pairs: VisiblePairs,
    positions: Floats,
    samples: SurfaceSamples,
    caster: RayCaster,
    rule: SightRule,
) -> NDArray[np.int32]:
    """Where the samples that no position sees are lost, by rays that ignore gimbal and GSD.

    Parameters
    ----------
    pairs
        What the positions see under the rule.
    positions, samples, caster, rule
        What it was made of.

    Returns
    -------
    stages
        From how many positions each sample is within range and incidence; unoccluded as well;
        within the gimbal's range as well; and within the GSD as well, shape (4, S). The two in
        the middle are counted only for samples that no position sees; others have the last.

    """
    stages = np.repeat(pairs.stages[3:], 4, axis=0)
    stages[0] = pairs.stages[0]
    rows = np.flatnonzero((stages[3] == 0) & (stages[0] > 0))
    if len(rows):
        lost = samples.places(rows)
        tilted = replace(rule, reach=math.inf)
        free = replace(tilted, low=-0.5 * math.pi, high=0.5 * math.pi)
        for stage, wider in ((1, free), (2, tilted)):
            stages[stage, rows] = visible_pairs(positions, lost, caster, wider).available
    return stages


def kept_out(
    samples: SurfaceSamples, rows: Ints, caster: RayCaster, rule: SightRule, airspace: Airspace
) -> Bools:
    """Tell which samples could be seen from where solids allow flight but a zone does not.

    Places around each sample's normal are probed; the ceiling and the geofence are zones too.

    Parameters
    ----------
    samples, rows
        Samples, and the rows that no free position sees, shape (n,).
    caster, rule, airspace
        What may be in the way, what makes a useful view, and where flight is safe.

    Returns
    -------
    kept_out
        Shape (S,).

    """
    found = np.zeros(len(samples), dtype=np.bool_)
    if not len(rows) or not np.isfinite(airspace.zone_margin(samples.xyz[rows])).any():
        return found
    starts = caster.lift(samples.xyz, samples.normals, radius=samples.radius)
    for first in range(0, len(rows), _BLOCK):
        part = rows[first : first + _BLOCK]
        places, cosine, distance = _probes(samples, part, rule)
        which = np.repeat(part, places.shape[1])
        flat = places.reshape(-1, 3)
        down = (samples.xyz[which] - flat)[:, 2] / distance.ravel()
        useful = (down >= math.sin(rule.low)) & (down <= math.sin(rule.high))
        useful &= distance.ravel() <= rule.reach * cosine.ravel()
        useful[useful] = airspace.zone_margin(flat[useful]) < 0.0
        useful[useful] = airspace.clearance(flat[useful]) >= airspace.d_min
        useful[useful] = ~caster.blocked(starts[which[useful]], flat[useful].astype(np.float32))
        found[which[useful]] = True
    return found


def _probes(samples: SurfaceSamples, rows: Ints, rule: SightRule) -> tuple[Floats, Floats, Floats]:
    """Places (n, p, 3) around the normals, with cosine of incidence and distance (n, p)."""
    normals = samples.normals[rows]
    helper = np.where(np.abs(normals[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    side = np.cross(normals, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(normals, side)
    tilt, turn, reach = (
        axis.ravel()
        for axis in np.meshgrid(
            np.array(_TILTS) * rule.max_incidence,
            np.arange(_TURNS) * (2.0 * math.pi / _TURNS),
            _REACHES,
        )
    )
    ray = (
        np.cos(tilt)[None, :, None] * normals[:, None]
        + (np.sin(tilt) * np.cos(turn))[None, :, None] * side[:, None]
        + (np.sin(tilt) * np.sin(turn))[None, :, None] * other[:, None]
    )
    distance = np.broadcast_to(rule.d_min + reach * (rule.d_max - rule.d_min), ray.shape[:2])
    places = samples.xyz[rows][:, None] + distance[..., None] * ray
    return places, np.broadcast_to(np.cos(tilt), ray.shape[:2]), distance
