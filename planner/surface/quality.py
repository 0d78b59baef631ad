"""Quality of the prior around each sample (paper 3.2.3, Eqs. 4 and 5)."""

import numpy as np

from planner.config import QualitySettings
from planner.geometry.arrays import Floats
from planner.scene.cloud import PointCloud
from planner.surface.completeness import (
    completeness,
    density_weight,
    neighbour_counts,
    reference_count,
)
from planner.surface.field import poisson_gradient, smoothed_normals
from planner.surface.samples import THINNING, ScoredSamples, SurfaceSamples
from planner.surface.smoothness import flatness, smoothness

DEFAULTS = QualitySettings()
_FIELD_WIDTH = 0.4  # standard deviation of the smoothed normals, share of R


def score_quality(
    samples: SurfaceSamples,
    cloud: PointCloud,
    *,
    thinned: PointCloud,
    settings: QualitySettings = DEFAULTS,
) -> ScoredSamples:
    """Score how well the prior has captured the surface around each sample.

    Parameters
    ----------
    samples
        Surface samples.
    cloud
        Full cloud, in which neighbours are counted, metres.
    thinned
        Thinned cloud with normals, for gradient and smoothness.
    settings
        Variants of Eqs. 1 to 5.

    Returns
    -------
    scored
        The samples with completeness, smoothness and quality.

    """
    counts = neighbour_counts(samples, cloud.xyz)
    reference = reference_count(samples, counts, settings.density_reference)
    weight = density_weight(counts, reference, settings.density_weight)
    complete = completeness(weight, _gradient(samples, thinned, settings), samples.normals)
    smooth = _smoothness(samples, thinned, settings)
    return ScoredSamples(
        samples.xyz,
        samples.normals,
        samples.cluster,
        samples.radius,
        completeness=complete,
        smoothness=smooth,
        quality=normalised(product(complete, smooth), clip_percent=settings.clip_percent),
    )


def product(completeness: Floats, smoothness: Floats) -> Floats:
    r"""Quality before normalisation, :math:`g(s_i) = g_c(s_i) g_s(s_i)` (Eq. 4), shape (S,)."""
    return completeness * smoothness


def normalised(quality: Floats, *, clip_percent: float) -> Floats:
    r"""Quality scaled to [0, 1] (Eq. 5), with percentiles in place of minimum and maximum.

    Parameters
    ----------
    quality
        Eq. 4, shape (S,).
    clip_percent
        So many percent at either end are clipped, lest one outlier moves all the others; 0 as
        printed.

    Returns
    -------
    quality
        Shape (S,), in [0, 1]; all 1 where nothing differs.

    """
    if len(quality) == 0:
        return quality
    low, high = np.percentile(quality, [clip_percent, 100.0 - clip_percent])
    if high <= low:
        return np.where(quality < low, 0.0, 1.0)
    return np.asarray(((quality - low) / (high - low)).clip(0.0, 1.0))


def _gradient(
    samples: SurfaceSamples, thinned: PointCloud, settings: QualitySettings
) -> Floats | None:
    if settings.gradient == "none":
        return None
    field = smoothed_normals if settings.gradient == "smoothed" else poisson_gradient
    area = np.full(len(thinned), (THINNING * samples.radius) ** 2)
    return field(thinned, samples.xyz, width=_FIELD_WIDTH * samples.radius, area=area)


def _smoothness(samples: SurfaceSamples, thinned: PointCloud, settings: QualitySettings) -> Floats:
    if settings.smoothness == "flatness":
        return flatness(samples, thinned, limit=settings.roughness)
    angle = float(np.radians(settings.angle_deg))
    return smoothness(samples, thinned, angle=angle, form=settings.smoothness)
