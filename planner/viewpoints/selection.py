"""Chosen photos, and what they see of each sample."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.config import ViewpointSettings
from planner.findings import Finding
from planner.geometry.arrays import Bools, Bytes, Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.images import Images
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.anchors import Anchors
from planner.viewpoints.camera import Camera
from planner.viewpoints.demand import Demand
from planner.viewpoints.graph import LinkRule, ViewGraph, link
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reasons import REASONS, Reason, explain
from planner.viewpoints.reconstructability import best_weight, reconstructability
from planner.viewpoints.sight import SightRule
from planner.viewpoints.ties import Matching, untied
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import Coverage, count_views
from solvers import Result


@dataclass(frozen=True, slots=True, eq=False)
class Wish:
    """What was asked of the photos, whatever they are.

    Parameters
    ----------
    demand
        From how many places and sectors each sample is wanted.
    reachable
        As much of that as all free positions together can give.
    stages
        From how many free positions each sample is within range and incidence, unoccluded as
        well, within the gimbal's range as well, and within the GSD as well, shape (4, S).
    binding
        Whether missing some of what is reachable makes the plan a partial one; missing all does.
    pairs
        What pairs of photos should give, or ``None`` where only hits count.
    zoned
        Which samples only zones keep from being seen, shape (S,), where that is known.

    """

    demand: Demand
    reachable: Demand
    stages: NDArray[np.int32]
    binding: bool
    pairs: "PairWish | None" = None
    zoned: Bools | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PairWish:
    """What was asked of pairs of photos.

    Parameters
    ----------
    target
        Wanted reconstructability h.
    share
        Share of the samples that can reach it that should.
    reachable
        Which samples can reach it from the free positions that were looked at, shape (S,).
    limited
        Whether the number of photos was given, so that the share is what they get.
    floor
        What was asked of samples below the target, if anything.

    """

    target: float
    share: float
    reachable: Bools
    limited: bool = False
    floor: "FloorWish | None" = None


@dataclass(frozen=True, slots=True, eq=False)
class FloorWish:
    """What was asked of samples that need not reach the target.

    Parameters
    ----------
    h
        Wanted reconstructability.
    share
        Share of the samples that can reach it that should.
    reachable
        Which samples can reach it, shape (S,).

    """

    h: float
    share: float
    reachable: Bools

    def reached(self, reconstructability: Floats) -> float:
        """Share of the samples that can reach it which do; 1 of none."""
        can = reconstructability[self.reachable]
        return float(np.mean(can >= self.h)) if len(can) else 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """The chosen photos and what they see.

    Parameters
    ----------
    viewpoints
        Where photos are taken, in no particular order.
    hits
        From how many distinct places each sample is seen, shape (S,), by fresh rays.
    sectors
        From how many distinct direction sectors each sample is seen, shape (S,).
    reason
        A :class:`~planner.viewpoints.reasons.Reason` each, shape (S,).
    reconstructability
        Benchmark heuristic h of each sample, exactly, by fresh rays, shape (S,).
    wish
        What was wanted of each sample, and what was possible.
    graph
        Which photos share enough to be matched.
    results
        Results of the solvers that were called, with cost and proven lower bound.
    findings
        What could not be fulfilled.
    reasons
        Name of each reason by its code.

    """

    viewpoints: Viewpoints
    hits: Ints
    sectors: Ints
    reason: Bytes
    reconstructability: Floats
    wish: Wish
    graph: ViewGraph
    results: tuple[Result[Ints], ...] = ()
    findings: tuple[Finding, ...] = ()
    reasons: tuple[str, ...] = REASONS

    def reason_counts(self) -> dict[str, int]:
        """How many samples ended with each reason."""
        counts = np.bincount(self.reason, minlength=len(self.reasons))
        return {name: int(count) for name, count in zip(self.reasons, counts, strict=True)}

    def reconstructable(self, target: float = 3.0) -> float:
        """Share of the samples with at least that h: of those that can reach it, if known."""
        wish = self.wish.pairs
        among = np.ones(len(self.reason), np.bool_) if wish is None else wish.reachable
        return float(np.mean(self.reconstructability[among] >= target)) if among.any() else 1.0

    @property
    def fulfilled(self) -> float:
        """Share of the samples that can be covered which are; by pairs, where these count."""
        wish = self.wish
        if wish.pairs is None:
            lack = (self.hits < wish.reachable.hits) | (self.sectors < wish.reachable.sectors)
            return float(np.mean(~lack)) if len(lack) else 1.0
        lack = _lacking(self.reconstructability, self.hits, wish.reachable, wish.pairs)
        lack = lack[wish.pairs.reachable]
        return float(np.mean(~lack)) if len(lack) else 1.0


def assess(
    viewpoints: Viewpoints,
    samples: SurfaceSamples,
    caster: RayCaster,
    camera: Camera,
    rule: SightRule,
    *,
    wish: Wish,
    links: LinkRule = LinkRule(),  # noqa: B008 - an immutable value
    results: tuple[Result[Ints], ...] = (),
    anchors: Anchors | None = None,
) -> Selection:
    """Work out by fresh rays what viewpoints see, and the reason of every sample."""
    seen = count_views(viewpoints, samples, caster, camera, rule)
    reference = 2.0 * rule.reach  # worth nothing at twice the distance that just meets the GSD
    seen_by = samples, caster, camera
    graph = link(viewpoints, *seen_by, reference=reference, links=links, anchors=anchors)
    h = reconstructability(viewpoints, samples, caster, camera, reference=reference)
    low, alike = np.zeros((2, len(h)), np.bool_)
    if wish.pairs is not None:
        low = h < wish.pairs.target
        rows = np.flatnonzero(low)
        best = reconstructability(
            *(viewpoints, samples.places(rows), caster, camera),
            reference=reference,
            weight=best_weight,
        )
        alike[rows] = best >= wish.pairs.target
    reason = explain(
        *(seen.hits, seen.sectors, wish.demand, wish.stages),
        low=low,
        alike=alike,
        zoned=wish.zoned,
    )
    findings = (*_unmet(reason, seen, h, wish), *_unlinked(graph))
    if anchors is not None:
        findings += untied(viewpoints, graph, Matching(*seen_by, anchors, reference, links))
    return Selection(viewpoints, seen.hits, seen.sectors, reason, h, wish, graph, results, findings)


def reassess(
    selection: Selection,
    viewpoints: Viewpoints,
    mesh: Mesh,
    samples: SurfaceSamples,
    camera: Camera,
    *,
    settings: ViewpointSettings,
    d_min: float,
    d_max: float,
    gsd: float,
    images: Images | None = None,
) -> Selection:
    """Selection with other viewpoints, such as those left after some were dropped.

    Hits, sectors, reasons, graph and findings are worked out anew; the wish and the
    solvers' results stay.
    """
    rule = SightRule.of(camera, settings, d_min=d_min, d_max=d_max, gsd=gsd)
    caster = RayCaster(mesh)
    return assess(
        *(viewpoints, samples, caster, camera, rule),
        wish=selection.wish,
        links=LinkRule.of(settings),
        results=selection.results,
        anchors=Anchors.of(images, samples, caster, camera, ties=settings.ties),
    )


def _unmet(reason: Bytes, seen: Coverage, h: Floats, wish: Wish) -> tuple[Finding, ...]:
    """Findings on samples that no photos could cover, and on those that these do not."""
    short = (seen.hits < wish.reachable.hits) | (seen.sectors < wish.reachable.sectors)
    possible = wish.reachable.hits > 0
    partial, words = wish.binding, "are seen less often than they could be"
    if wish.pairs is not None:
        possible = wish.pairs.reachable
        short = possible & _lacking(h, seen.hits, wish.reachable, wish.pairs)
        done, most = int((possible & ~short).sum()), int(possible.sum())
        partial = done < wish.pairs.share * most - 1e-9 and not wish.pairs.limited
        words = (
            "are reconstructed worse than they could be; "
            f"{100.0 * done / max(1, most):.1f} % of what can be reconstructed is"
            + ("" if wish.pairs.limited else f", where {100.0 * wish.pairs.share:g} % are wanted")
        )
    elif not wish.binding:
        words += ": the paper's marks count what is near a photo's target, seen or not"
    partial |= bool(possible.any()) and not (possible & ~short).any()  # of no use to anyone
    beyond = (reason != Reason.COVERED) & ~short
    found = []
    for code, rows, what, grave in (
        ("samples-short", short, words, partial),
        ("samples-out-of-reach", beyond, "cannot be covered from where it is safe to fly", False),
    ):
        count = int(np.count_nonzero(rows))
        if count:
            message = f"{count} of {len(reason)} samples {what}"
            found.append(Finding("viewpoints", code, message, float(count), grave))
    floor = None if wish.pairs is None else wish.pairs.floor
    if floor is not None and floor.reached(h) < floor.share - 1e-9:
        message = (
            f"{100.0 * floor.reached(h):.1f} % of what can have a reconstructability of "
            f"{floor.h:g} has it, where {100.0 * floor.share:g} % are wanted"
        )
        found.append(Finding("viewpoints", "samples-below-floor", message, floor.reached(h), False))
    return tuple(found)


def _lacking(h: Floats, hits: Ints, reachable: Demand, pairs: PairWish) -> Bools:
    """Which samples miss the target, or sharp photos that they could have, by pairs of photos."""
    return np.asarray((h < pairs.target) | (hits < reachable.hits))


def _unlinked(graph: ViewGraph) -> tuple[Finding, ...]:
    """Finding on photos that are linked to too few others, or by no chain to the most."""
    if graph.components <= 1:
        loose = int(np.count_nonzero(graph.degree < graph.wanted_degree))
        message = f"{loose} of {len(graph.degree)} photos match fewer than three others"
        return (Finding("viewpoints", "photos-loose", message, loose, False),) if loose else ()
    apart = len(graph.component) - int(np.bincount(graph.component).max())
    message = f"{apart} of {len(graph.component)} photos may not match with the others"
    return (Finding("viewpoints", "photos-unlinked", message, float(apart), False),)
