"""What pairs of photos can triangulate: the field's benchmark heuristic, exactly."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from planner.geometry.arrays import Floats, Ints
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.pairs import Aims, visible_pairs
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints

GRAZING = math.radians(85.0)


def parallax_weight(angle: ArrayLike) -> Floats:
    r"""Worth :math:`w_1 w_3` of the angle between two rays, radians, any shape; in [0, 1].

    :math:`w_1 = 1 / (1 + e^{-32 (\alpha - \pi/16)})` rewards parallax,
    :math:`w_3 = 1 - 1 / (1 + e^{-8 (\alpha - \pi/4)})` asks that the views look alike.
    """
    angle = np.asarray(angle, dtype=np.float64)
    parallax = 1.0 / (1.0 + np.exp(-32.0 * (angle - np.pi / 16.0)))
    alike = 1.0 - 1.0 / (1.0 + np.exp(-8.0 * (angle - np.pi / 4.0)))
    return np.asarray(parallax * alike)


def best_weight(angle: ArrayLike) -> Floats:
    """Highest worth of any angle, whatever the angles are, same shape; at about 20 degrees."""
    peak = parallax_weight(np.radians(np.linspace(15.0, 25.0, 101))).max()
    return np.full(np.shape(angle), peak)


def pair_sums(
    sample: Ints,
    rays: Floats,
    distance: Floats,
    cosine: Floats,
    *,
    size: int,
    reference: float,
    weight: Callable[[Floats], Floats] = parallax_weight,
) -> Floats:
    r"""Sum :math:`h(s) = \sum_{i<j} w_1 w_2 w_3 c` of each sample over pairs of its views.

    Parameters
    ----------
    sample
        Sample of each view, shape (n,).
    rays
        Unit rays from sample to camera, shape (n, 3).
    distance, cosine
        Length of each ray, metres, and the cosine of its incidence, shape (n,).
    size
        Number of samples.
    reference
        Distance at which :math:`w_2 = \max(0, 1 - \max(l_i, l_j) / d_{ref})` vanishes, metres.
    weight
        Worth of the angle between two rays, in place of :math:`w_1 w_3`.

    Returns
    -------
    h
        Shape (size,), at least 0.

    """
    order = np.argsort(sample, kind="stable")
    sample, rays, distance, cosine = sample[order], rays[order], distance[order], cosine[order]
    total = np.zeros(size)
    most = int(np.bincount(sample, minlength=1).max()) if len(sample) else 0
    for apart in range(1, most):  # views of a sample are neighbours now: pair each with the next
        first = np.flatnonzero(sample[apart:] == sample[:-apart])
        second = first + apart
        dot = np.einsum("ij,ij->i", rays[first], rays[second])
        useful = weight(np.arccos(dot.clip(-1.0, 1.0)))
        near = 1.0 - np.maximum(distance[first], distance[second]) / reference
        facing = np.minimum(cosine[first], cosine[second])
        worth = useful * near.clip(0.0) * facing.clip(0.0)
        total += np.bincount(sample[first], worth, minlength=size)
    return total


def reconstructability(
    viewpoints: Viewpoints,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    *,
    reference: float,
    weight: Callable[[Floats], Floats] = parallax_weight,
) -> Floats:
    """Reconstructability of each sample under a set of viewpoints, by fresh rays.

    Parameters
    ----------
    viewpoints, samples, caster, camera
        The photos, what they should show, what may be in the way, and the field of view.
    reference
        Reference distance, metres: twice the distance that just meets the wanted GSD.
    weight
        As in :func:`pair_sums`.

    Returns
    -------
    h
        Shape (S,); 3 is the field's mark for what stereo reconstructs well.

    """
    rule = SightRule(d_min=0.0, d_max=reference, max_incidence=GRAZING)
    aims = Aims(viewpoints.yaw_deg, viewpoints.pitch_deg, camera)
    pairs = visible_pairs(viewpoints.positions, samples, caster, rule, aims)
    sample = pairs.sample.astype(np.int64)
    rays = viewpoints.positions[pairs.position] - samples.xyz[sample]
    distance = np.linalg.norm(rays, axis=1)
    rays /= distance[:, None]
    cosine = np.einsum("ij,ij->i", rays, samples.normals[sample])
    return pair_sums(
        *(sample, rays, distance, cosine), size=len(samples), reference=reference, weight=weight
    )
