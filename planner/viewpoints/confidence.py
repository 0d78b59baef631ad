"""How well a viewpoint sees a surface sample (paper section 3.3.2, Eqs. 6 and 7)."""

import numpy as np
from numpy.typing import ArrayLike

from planner.geometry.arrays import Floats


def viewing_confidence(
    positions: Floats,
    samples: Floats,
    normals: Floats,
    *,
    d_min: float,
    d_max: float,
    max_angle: float,
) -> Floats:
    r"""Confidence that each viewpoint observes each sample well, ignoring occlusion.

    The product of the distance term :math:`c_d` (Eq. 6) and the orientation term
    :math:`c_o` (Eq. 7). The visibility weight :math:`w_v` of Eq. 8 is the business of
    :mod:`planner.viewpoints.pairs`, which has the surface to cast rays against.

    Parameters
    ----------
    positions
        Viewpoint positions, shape (V, 3), metres, local frame, z up.
    samples
        Surface samples, shape (S, 3), metres, same frame.
    normals
        Unit outward normals of the samples, shape (S, 3).
    d_min, d_max
        Closest and farthest observation distance, metres, ``0 < d_min < d_max``.
    max_angle
        Angle :math:`\theta_t` at which :math:`c_o` falls to 1/e, radians, in (0, pi].

    Returns
    -------
    confidence
        Shape (V, S), in [0, 1]; exactly 0 outside ``[d_min, d_max]`` and for samples above
        the viewpoint, since the paper's camera does not look upwards.

    Raises
    ------
    ValueError
        If the distances are out of order or ``max_angle`` is out of range.

    """
    rays = positions[:, None, :] - samples[None, :, :]  # (V, S, 3)
    distance = np.linalg.norm(rays, axis=2)  # (V, S)
    along = np.einsum("vsk,sk->vs", rays, normals)
    cosine = np.divide(along, distance, out=np.zeros_like(along), where=distance > 0.0)
    confidence = pair_confidence(distance, cosine, d_min=d_min, d_max=d_max, max_angle=max_angle)
    return np.where(rays[:, :, 2] >= 0.0, confidence, 0.0)


def pair_confidence(
    distance: ArrayLike, cosine: ArrayLike, *, d_min: float, d_max: float, max_angle: float
) -> Floats:
    r"""Eqs. 6 and 7 for pairs whose distance and incidence are known.

    Parameters
    ----------
    distance
        Viewpoint to sample, metres, any shape.
    cosine
        Cosine of the incidence :math:`n_s \cdot d(v, s)`, same shape.
    d_min, d_max, max_angle
        As in :func:`viewing_confidence`.

    Returns
    -------
    confidence
        Same shape, in [0, 1].

    Raises
    ------
    ValueError
        If the distances are out of order or ``max_angle`` is out of range.

    """
    if not 0.0 < d_min < d_max:
        raise ValueError(f"need 0 < d_min < d_max, got {d_min} and {d_max}.")
    if not 0.0 < max_angle <= np.pi:
        raise ValueError(f"max_angle must be in (0, pi] radians, got {max_angle}.")
    distance = np.asarray(distance, dtype=np.float64)
    d_opt = 0.5 * (d_min + d_max)
    by_distance = 1.0 - ((distance - d_opt) / (d_opt - d_min)) ** 2  # Eq. 6
    fall = (1.0 - np.asarray(cosine, dtype=np.float64)) / (1.0 - np.cos(max_angle))
    by_angle = np.exp(-(fall**2))  # Eq. 7
    return np.where((d_min <= distance) & (distance <= d_max), by_distance * by_angle, 0.0)
