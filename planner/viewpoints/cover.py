"""Preset ``cover``: the candidates and their prices."""

import math

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Floats
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import Candidates, add_direct_aims, generate_candidates
from planner.viewpoints.confidence import pair_confidence
from planner.viewpoints.demand import Demand
from planner.viewpoints.pairs import VisiblePairs


def cover_candidates(
    positions: Floats,
    pairs: VisiblePairs,
    samples: SurfaceSamples,
    camera: Camera,
    *,
    demand: Demand,
    settings: ViewpointSettings,
) -> Candidates:
    """Poses to choose from, enough to meet every demand that the positions allow.

    A sample weighs its demand over the root of the number of places that see it, so that
    the aims do not leave out what is rarely seen.
    """
    weights = demand.hits / np.sqrt(np.maximum(pairs.available, 1))
    candidates = generate_candidates(
        positions,
        pairs,
        samples,
        camera,
        aims=settings.aims,
        directions=settings.aim_directions,
        weights=weights,
    )
    return add_direct_aims(candidates, samples, camera, demand)


def photo_prices(
    candidates: Candidates, *, settings: ViewpointSettings, d_min: float, d_max: float
) -> Floats:
    """Price of each candidate: 1 + ``confidence_price`` (1 - mean confidence), shape (K,)."""
    pairs = candidates.pairs
    confidence = pair_confidence(
        pairs.distance,
        pairs.cosine,
        d_min=d_min,
        d_max=d_max,
        max_angle=math.radians(settings.confidence_angle_deg),
    )
    total = np.concatenate([[0.0], np.cumsum(confidence[candidates.pair])])
    counts = np.diff(candidates.indptr)
    mean = (total[candidates.indptr[1:]] - total[candidates.indptr[:-1]]) / np.maximum(counts, 1)
    return np.asarray(1.0 + settings.confidence_price * (1.0 - mean.clip(0.0, 1.0)))
