"""How good chosen photos are, by one protocol for every way of choosing them."""

import math
from dataclasses import dataclass

import numpy as np

from planner.attempts import Prior
from planner.evaluation.place import fresh_samples
from planner.evaluation.reachable import reachable
from planner.evaluation.sightings import Sightings
from planner.geometry.angles import circular_difference_deg
from planner.geometry.arrays import Bools, Floats
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.selection import Selection
from planner.viewpoints.viewpoints import Viewpoints

NOISE_METRES, NOISE_DEG = 0.5, 2.0
"""Standard deviations of the pose noise: along each axis, and of yaw and pitch."""
DRAWS = 4
"""Draws of the pose noise whose mean is given."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """A place with the samples that photos are judged by.

    Parameters
    ----------
    place
        The place.
    fresh
        Samples that no choice of photos has seen.
    reachable, fresh_reachable
        Which of the place's own samples, and which of the fresh ones, any photos could
        reconstruct.

    """

    place: Prior
    fresh: SurfaceSamples
    reachable: Bools
    fresh_reachable: Bools


@dataclass(frozen=True, slots=True)
class ViewMeasures:
    """How good photos are; shares are of the samples that any photos could reconstruct.

    Parameters
    ----------
    views
        Number of photos.
    share, better
        Share of the fresh samples with a reconstructability h of at least 3, and of 4.
    planned
        Share of the samples that the photos were chosen by with h of at least 3.
    noisy, noisy_better
        The first two under pose noise, mean of the draws.
    matchable
        Share of the fresh samples with three photos within 70 degrees, two of them at 5 to 30.
    gsd, coarse_gsd
        Median and 95 % quantile of the GSD of the nearest photo within 70 degrees, metres.
    nearest
        Median distance of that photo, metres.
    components, least_degree
        Of the view graph.
    tour
        Length of a short closed tour through all photos, metres.
    bound, gap
        What the last solver proved of its cost; NaN where nothing.
    seconds
        Processor time that the choice took, of all threads.

    """

    views: int
    share: float
    better: float
    planned: float
    noisy: float
    noisy_better: float
    matchable: float
    gsd: float
    coarse_gsd: float
    nearest: float
    components: int
    least_degree: int
    tour: float
    bound: float
    gap: float
    seconds: float


def trial(place: Prior) -> Trial:
    """Draw fresh samples and find what is reachable, from the evaluation grid."""
    fresh = fresh_samples(place)
    return Trial(place, fresh, reachable(place, place.samples), reachable(place, fresh))


def measure_views(case: Trial, selection: Selection, *, seconds: float) -> ViewMeasures:
    """Measure chosen photos by fresh rays and the exact formula.

    Parameters
    ----------
    case
        The place, and the samples to judge by.
    selection
        Photos as they were chosen there.
    seconds
        How long that took.

    """
    views, place = selection.viewpoints, case.place
    caster = RayCaster(place.surface.mesh)
    seen = _sightings(views, case, case.fresh, caster)
    level = seen.reconstructability(place.reference)
    own = _sightings(views, case, place.samples, caster).reconstructability(place.reference)
    draws = [_sightings(shaken(views, seed), case, case.fresh, caster) for seed in range(DRAWS)]
    noisy = np.array([draw.reconstructability(place.reference) for draw in draws])
    distance, stretched = (values[case.fresh_reachable] for values in seen.nearest())
    proof = selection.results[-1] if selection.results else None
    proven = proof is not None and math.isfinite(proof.bound)
    among = case.fresh_reachable
    return ViewMeasures(
        views=len(views),
        share=_share(level >= 3.0, among),
        better=_share(level >= 4.0, among),
        planned=_share(own >= 3.0, case.reachable),
        noisy=_share((noisy >= 3.0).mean(axis=0), among),
        noisy_better=_share((noisy >= 4.0).mean(axis=0), among),
        matchable=_share(seen.matchable(), among),
        gsd=_quantile(stretched, 0.5) / place.camera.focal_px,
        coarse_gsd=_quantile(stretched, 0.95) / place.camera.focal_px,
        nearest=_quantile(distance, 0.5),
        components=selection.graph.components,
        least_degree=int(selection.graph.degree.min(initial=len(views))),
        tour=closed_tour(views.positions),
        bound=proof.bound if proof is not None and proven else math.nan,
        gap=proof.gap if proof is not None and proven else math.nan,
        seconds=seconds,
    )


def shaken(views: Viewpoints, seed: int) -> Viewpoints:
    """Photos as a drone in the wind would take them: each pose with normal noise."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2,)))
    yaw = views.yaw_deg + rng.normal(0.0, NOISE_DEG, len(views))
    pitch = views.pitch_deg + rng.normal(0.0, NOISE_DEG, len(views))
    return Viewpoints(
        views.positions + rng.normal(0.0, NOISE_METRES, (len(views), 3)),
        circular_difference_deg(yaw, np.zeros(len(yaw))),
        pitch.clip(-90.0, 90.0),
        views.kind,
        views.targets,
    )


def closed_tour(positions: Floats) -> float:
    """Length of a short closed tour through positions, (V, 3), metres, by straight lines."""
    from solvers import solve
    from solvers.tour import TourProblem

    gaps = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    if len(positions) < 2:
        return 0.0
    return float(solve(TourProblem(gaps, closed=True), "auto", seed=0).cost)


def _sightings(
    views: Viewpoints, case: Trial, samples: SurfaceSamples, caster: RayCaster
) -> Sightings:
    return Sightings.of(views, samples, caster, case.place.camera, reference=case.place.reference)


def _share(good: Bools | Floats, among: Bools) -> float:
    """Mean of what is good among some; 1 among none."""
    return float(np.mean(good[among])) if among.any() else 1.0


def _quantile(values: Floats, share: float) -> float:
    """Quantile without interpolation, so that infinite values may be among them."""
    return float(np.quantile(values, share, method="higher")) if len(values) else math.nan
