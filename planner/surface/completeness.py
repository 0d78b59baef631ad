"""How completely the prior covers each sample (paper 3.2.3, Eq. 1)."""

from typing import Literal

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.surface.quantile import grouped_quantile
from planner.surface.samples import SurfaceSamples

_SAME_WAY = 0.7  # cosine of 45 degrees
_SURROUNDINGS = 10.0  # radii
_QUARTILE = 75.0  # percentile
_FORGIVEN = 2.0  # standard deviations
_BLOCK = 4096


def neighbour_counts(samples: SurfaceSamples, points: Floats) -> Ints:
    r"""Number of points within R of each sample, :math:`|\mathcal N_i|`, shape (S,).

    ``points``, shape (N, 3), are the full cloud: thinning would hide where it is thin.
    """
    from scipy.spatial import cKDTree

    counts = cKDTree(points).query_ball_point(samples.xyz, samples.radius, return_length=True)
    return np.asarray(counts, dtype=np.int64)


def reference_count(
    samples: SurfaceSamples, counts: Ints, reference: Literal["local", "maximum"]
) -> Floats:
    r"""How many neighbours a sample should have, :math:`|\mathcal N_{max}|` of Eq. 1.

    ``maximum`` is the paper's: the largest count of all. One dense spot then makes everything else
    look empty. ``local`` compares neighbours for the surface there is around a sample (at the rim
    of the scene there is half) with the geometric mean of two upper quartiles of that density: over
    the samples within 10 R that face the same way, since a scan sees roofs and facades unequally,
    and over all, since a facade that is sparse all over is still to be photographed. Two standard
    deviations of counting noise are forgiven. Samples without any neighbour do not vote.

    Parameters
    ----------
    samples
        Surface samples.
    counts
        Neighbours of each, shape (S,).
    reference
        Which of the two.

    Returns
    -------
    reference
        Shape (S,), at least 1.

    """
    if reference == "maximum" or not (counts > 0).any():
        return np.full(len(counts), max(1.0, float(counts.max(initial=0))))
    around = _surface_around(samples)
    density = counts / around
    overall = float(np.percentile(density[counts > 0], _QUARTILE))
    expected = around * np.sqrt(overall * _surrounding_quartile(samples, density, overall))
    return np.maximum(1.0, expected - _FORGIVEN * np.sqrt(expected))


def _surface_around(samples: SurfaceSamples) -> Floats:
    """How much surface lies around each sample, in samples weighted by a Gaussian of width R."""
    from scipy.spatial import cKDTree

    tree = cKDTree(samples.xyz)
    pairs = tree.sparse_distance_matrix(tree, 3.0 * samples.radius, output_type="ndarray")
    weight = np.exp(-0.5 * (pairs["v"] / samples.radius) ** 2)
    return np.asarray(np.bincount(pairs["i"], weight, minlength=len(samples)))


def _surrounding_quartile(samples: SurfaceSamples, density: Floats, default: float) -> Floats:
    """Upper quartile of the density around each sample, facing its way; ``default`` without any."""
    from scipy.spatial import cKDTree

    voters = np.flatnonzero(density > 0)
    tree = cKDTree(samples.xyz[voters])
    quartile = np.full(len(density), default)
    for first in range(0, len(density), _BLOCK):  # few: a block bounds the memory
        rows = slice(first, first + _BLOCK)
        pairs = cKDTree(samples.xyz[rows]).sparse_distance_matrix(
            tree, _SURROUNDINGS * samples.radius, output_type="ndarray"
        )
        row, voter = first + pairs["i"], voters[pairs["j"]]
        cosine = np.einsum("pc,pc->p", samples.normals[row], samples.normals[voter])
        row, voter = row[cosine > _SAME_WAY], voter[cosine > _SAME_WAY]
        found, value = grouped_quantile(row, density[voter], _QUARTILE / 100.0)
        quartile[found] = value
    return quartile


def density_weight(counts: Ints, reference: Floats, form: Literal["intended", "printed"]) -> Floats:
    r"""Density weight :math:`w_i` of Eq. 1.

    As printed, :math:`(1 - (|\mathcal N_i| - |\mathcal N_{max}|) / |\mathcal N_{max}|)^2`, it is 4
    for an empty neighbourhood and 1 for the densest, against the text. Intended is
    :math:`(|\mathcal N_i| / |\mathcal N_{max}|)^2`, which is 0 and 1.

    Parameters
    ----------
    counts
        Neighbours of each sample, shape (S,).
    reference
        :math:`|\mathcal N_{max}|`, shape (S,), positive; denser is not better.
    form
        Which of the two.

    Returns
    -------
    weight
        Shape (S,).

    """
    share = np.minimum(counts / reference, 1.0)
    return share**2 if form == "intended" else (2.0 - share) ** 2


def completeness(weight: Floats, gradient: Floats | None, normals: Floats) -> Floats:
    r"""Completeness score :math:`g_c(s_i) = w_i \nabla(s_i) \cdot \mathbf n_i` (Eq. 1).

    Parameters
    ----------
    weight
        Density weight, shape (S,).
    gradient
        Gradient of the Poisson reconstruction at each sample, shape (S, 3); ``None`` counts it as
        the sample's normal, which leaves the weight.
    normals
        Unit normals of the samples, shape (S, 3).

    Returns
    -------
    completeness
        Shape (S,); where the gradient points inward it is 0, as in a hole.

    """
    if gradient is None:
        return weight
    return np.asarray(weight * np.einsum("sc,sc->s", gradient, normals).clip(0.0))
