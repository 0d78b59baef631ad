"""Preset ``cover``: candidates, their prices, and the completion of a cover."""

import math

import numpy as np

from planner.config import ViewpointSettings
from planner.geometry.arrays import Bools, Floats, Ints
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
    want = np.maximum(demand.hits, demand.sectors)
    return add_direct_aims(candidates, samples, camera, want)


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


def complete_cover(candidates: Candidates, chosen: Ints, *, demand: Demand, prices: Floats) -> Ints:
    """Add poses until every demand is met that all candidates together can meet.

    For selections in which photos from one place were counted as several hits. Each step
    adds the pose that gives most missing hits and sectors for its price.

    Parameters
    ----------
    candidates
        Poses to choose from.
    chosen
        Rows of the poses chosen so far, shape (k,).
    demand
        What each sample wants.
    prices
        Price of each candidate, positive, shape (K,).

    Returns
    -------
    chosen
        Sorted rows, the given ones among them.

    """
    owner = np.repeat(np.arange(len(candidates)), np.diff(candidates.indptr))
    taken = set(chosen.tolist())
    while True:
        useful = _useful_hits(candidates, np.array(sorted(taken), dtype=np.int64), demand)
        if not useful.any():
            return np.array(sorted(taken), dtype=np.int64)
        gain = np.bincount(owner[useful], minlength=len(candidates)) / prices
        taken.add(int(np.argmax(gain)))


def _useful_hits(candidates: Candidates, chosen: Ints, demand: Demand) -> Bools:
    """Hits, shape (nnz,), that would fill a demand that the chosen poses leave open."""
    pairs, size = candidates.pairs, len(demand.hits)
    seen = np.zeros(len(pairs), dtype=np.bool_)
    for candidate in chosen:  # few: the viewpoints of a plan
        seen[candidates.row(candidate)] = True
    hits = np.bincount(pairs.sample[seen], minlength=size)
    sides = np.zeros((size, int(pairs.sector.max(initial=0)) + 1), dtype=np.bool_)
    sides[pairs.sample[seen], pairs.sector[seen]] = True
    lacks_hits = hits < demand.hits
    lacks_sides = sides.sum(axis=1) < demand.sectors
    useful = ~seen & (
        lacks_hits[pairs.sample] | (lacks_sides[pairs.sample] & ~sides[pairs.sample, pairs.sector])
    )
    return np.asarray(useful[candidates.pair])
