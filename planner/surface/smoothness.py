"""How smooth the prior is around each sample (paper 3.2.3, Eqs. 2 and 3)."""

from typing import Literal

import numpy as np

from planner.geometry.arrays import Floats
from planner.scene.cloud import PointCloud
from planner.surface.oriented import normals_of
from planner.surface.quantile import grouped_quantile
from planner.surface.samples import SurfaceSamples

_PLANE = 12  # points to a local plane
_ROUGHEST = 0.2  # what the roughest place keeps, so that a hole stays below it
_SHARE = 0.1  # of the neighbours may be enough: the flat sides of an edge, a gap in a tree


def distance_weight(distance: Floats, radius: float) -> Floats:
    r"""Distance weight :math:`w_{p_j} = \exp(-|s_i - p_j| / R)` (Eq. 3), of any shape."""
    return np.exp(-distance / radius)


def smoothness(
    samples: SurfaceSamples, cloud: PointCloud, *, angle: float, form: Literal["sum", "mean"]
) -> Floats:
    r"""Smoothness score :math:`g_s(s_i)` of normals that agree with the sample's (Eq. 2).

    .. math:: \sum_{p_j \in \mathcal N_i} w_{p_j}
              \exp(-(1 - N_{p_j} \cdot n_i)^2 / (1 - \cos\theta_t)^2)

    Parameters
    ----------
    samples
        Surface samples.
    cloud
        Thinned cloud with normals, metres.
    angle
        Angle :math:`\theta_t` at which a normal counts 1/e, radians, in (0, pi].
    form
        ``sum`` as printed, which grows with density; ``mean`` divides by the sum of the weights.

    Returns
    -------
    smoothness
        Shape (S,), 0 without neighbours; a mean is in [0, 1].

    """
    from scipy.spatial import cKDTree

    pairs = cKDTree(samples.xyz).sparse_distance_matrix(
        cKDTree(cloud.xyz), samples.radius, output_type="ndarray"
    )
    row, point = pairs["i"], pairs["j"]
    weight = distance_weight(pairs["v"], samples.radius)
    cosine = np.einsum("pc,pc->p", normals_of(cloud)[point], samples.normals[row])
    agreement = np.exp(-(((1.0 - cosine) / (1.0 - np.cos(angle))) ** 2))
    total = np.bincount(row, weight * agreement, minlength=len(samples))
    if form == "sum":
        return np.asarray(total, dtype=np.float64)
    weights = np.bincount(row, weight, minlength=len(samples))
    return np.asarray(total / np.where(weights > 0.0, weights, 1.0))


def roughness(cloud: PointCloud) -> Floats:
    """Root mean square distance of each point's neighbours to their plane, shape (N,), metres.

    Unlike the normals of Eq. 2 it tells noise from a corner, and does not tire of trees whose
    normals happen to agree.
    """
    from scipy.spatial import cKDTree

    _, near = cKDTree(cloud.xyz).query(cloud.xyz, k=min(_PLANE, len(cloud)))
    around = cloud.xyz[near.reshape(len(cloud), -1)]
    around = around - around.mean(axis=1, keepdims=True)
    spread = np.einsum("nki,nkj->nij", around, around) / around.shape[1]
    return np.asarray(np.sqrt(np.linalg.eigvalsh(spread)[:, 0].clip(0.0)))


def flatness(samples: SurfaceSamples, cloud: PointCloud, *, limit: float) -> Floats:
    r"""Smoothness as :math:`f + (1 - f) \exp(-(\rho_i / (\ell R))^2)` of the roughness around.

    What :func:`smoothness` is for, measured on positions instead of normals. The lower decile
    :math:`\rho_i` lets edges pass, where only the points along the crease are rough; amid noise all
    are. Even there :math:`f = 0.2` remains: trees are rough, but they are not holes.

    Parameters
    ----------
    samples
        Surface samples.
    cloud
        Thinned cloud, metres.
    limit
        Roughness :math:`\ell`, as a share of R, at which the exponential is 1/e.

    Returns
    -------
    flatness
        Shape (S,), in [0.2, 1]; 0 without neighbours.

    """
    from scipy.spatial import cKDTree

    pairs = cKDTree(samples.xyz).sparse_distance_matrix(
        cKDTree(cloud.xyz), samples.radius, output_type="ndarray"
    )
    found, value = grouped_quantile(pairs["i"], roughness(cloud)[pairs["j"]], _SHARE)
    score = np.zeros(len(samples))
    fine = np.exp(-((value / (limit * samples.radius)) ** 2))
    score[found] = _ROUGHEST + (1.0 - _ROUGHEST) * fine
    return score
