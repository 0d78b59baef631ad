"""Scanned marks: the paper's greedy choice of viewpoints for one set of samples."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.geometry.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


class Chosen(NamedTuple):
    """A viewpoint by the rows of its position and of the sample that it aims at."""

    place: int
    target: int
    kind: str


@dataclass(frozen=True, eq=False)
class ScanJob:
    """Samples to be scanned, and the confidence of each position for each.

    Parameters
    ----------
    positions
        Free positions, shape (V, 3), metres.
    xyz, quality
        Samples, shapes (S, 3) and (S,).
    indptr, place, confidence
        Positions that see each sample, with the confidence of Eq. 8; CSR over the samples.
    spread
        Sine of half the field of view: a view at distance d marks what is within
        ``d spread`` of its target.
    adjacency
        Positions at most this far apart along every axis are adjacent, metres.
    threshold
        Samples of a quality below it get local viewpoints.
    marks
        Marks that each sample wants.
    each
        Whether every low-quality sample gets a local viewpoint, or only one short of marks.
    rows
        Rows of these samples among all, shape (S,), or ``None`` where they are all.

    """

    positions: Floats
    xyz: Floats
    quality: Floats
    indptr: Ints
    place: NDArray[np.int32]
    confidence: Floats
    spread: float
    adjacency: float
    threshold: float
    marks: int
    each: bool
    rows: Ints | None = None

    def part(self, rows: Ints) -> "ScanJob":
        """Return the job of some of the samples."""
        sizes = np.diff(self.indptr)[rows]
        spans = [np.arange(self.indptr[row], self.indptr[row + 1]) for row in rows]
        at = np.concatenate([np.empty(0, dtype=np.int64), *spans])
        return replace(
            self,
            xyz=self.xyz[rows],
            quality=self.quality[rows],
            indptr=np.concatenate([[0], np.cumsum(sizes)]),
            place=self.place[at],
            confidence=self.confidence[at],
            rows=rows,
        )


def scan_cluster(job: ScanJob) -> list[Chosen]:
    """Choose the local, then the global viewpoints of one cluster, targets among all rows."""
    scanner = Scanner(job)
    scanner.scan_low_quality()
    chosen = scanner.fill()
    rows = np.arange(len(job.xyz)) if job.rows is None else job.rows
    return [view._replace(target=int(rows[view.target])) for view in chosen]


class Scanner:
    """Marks of all samples while viewpoints are chosen one by one."""

    def __init__(self, job: ScanJob) -> None:
        self._job = job
        self._order = np.argsort(job.quality, kind="stable")  # worst first, ties by row
        self._taken = np.zeros(len(job.positions), dtype=np.bool_)
        self._adjacent = np.zeros(len(job.positions), dtype=np.bool_)
        self.marks = np.zeros(len(job.xyz), dtype=np.int64)
        self.chosen: list[Chosen] = []

    @cached_property
    def _samples(self) -> "cKDTree[Any]":
        from scipy.spatial import cKDTree

        return cKDTree(self._job.xyz)

    @cached_property
    def _places(self) -> "cKDTree[Any]":
        from scipy.spatial import cKDTree

        return cKDTree(self._job.positions)

    def scan_low_quality(self) -> None:
        """Give low-quality samples the best position that is not taken yet."""
        job = self._job
        for sample in self._order[job.quality[self._order] < job.threshold]:
            if job.each or self.marks[sample] < job.marks:
                self._choose(int(sample), "local", (self._taken,))

    def fill(self) -> list[Chosen]:
        """Give each sample short of marks the best positions that are left.

        Positions adjacent to chosen ones are left out, then only chosen ones, and at last
        only those that already aim at this very sample. Returns all that was chosen.
        """
        for sample in self._order:
            for excluded in ((self._taken, self._adjacent), (self._taken,), ()):
                while self.marks[sample] < self._job.marks:
                    if not self._choose(int(sample), "global", excluded):
                        break
        return self.chosen

    def accept(self, views: Iterable[Chosen]) -> None:
        """Take over what was chosen elsewhere, but for taken positions and crowded global ones."""
        for view in views:
            crowded = view.kind == "global" and self._adjacent[view.place]
            if not (self._taken[view.place] or crowded):
                self._add(view)

    def _choose(self, sample: int, kind: str, excluded: tuple[Bools, ...]) -> bool:
        job = self._job
        span = slice(job.indptr[sample], job.indptr[sample + 1])
        places, confidence = job.place[span], job.confidence[span].copy()
        for flags in excluded:
            confidence[flags[places]] = 0.0
        aimed = [view.place for view in self.chosen if view.target == sample]
        confidence[np.isin(places, aimed)] = 0.0
        if not len(places) or confidence.max() <= 0.0:
            return False
        self._add(Chosen(int(places[np.argmax(confidence)]), sample, kind))
        return True

    def _add(self, view: Chosen) -> None:
        job = self._job
        place, target = job.positions[view.place], job.xyz[view.target]
        radius = float(np.linalg.norm(place - target)) * job.spread
        self.marks[self._samples.query_ball_point(target, radius)] += 1
        self._taken[view.place] = True
        if job.adjacency > 0.0:
            reach = job.adjacency * (1.0 + 1e-6)
            self._adjacent[self._places.query_ball_point(place, reach, p=np.inf)] = True
        self.chosen.append(view)
