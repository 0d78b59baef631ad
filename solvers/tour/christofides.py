"""Christofides' tour, at most half again as long as the best one, through networkx."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.result import Status
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.problem import Order, TourProblem


@dataclass(frozen=True, slots=True)
class Christofides:
    """Spanning tree, cheapest matching of its odd places, round walk, short cuts; one iteration.

    The guarantee of 3/2 holds for round trips whose costs obey the triangle inequality. An
    open order is the round trip without its dearest leg, or cut where its ends are fixed. The
    matching takes time as n^3 (a second for 300 places) and cannot be stopped on the way, so
    that a limit on seconds alone is refused.

    References
    ----------
    Christofides, "Worst-case analysis of a new heuristic for the travelling salesman
    problem", 1976, doi:10.1007/s43069-021-00101-z (reprint).

    """

    name: ClassVar[str] = "christofides"
    requires: ClassVar[tuple[str, ...]] = ("networkx",)
    cannot: ClassVar[frozenset[str]] = frozenset({"asymmetric"})
    ignores: ClassVar[frozenset[str]] = frozenset({"seconds"})
    default_stop: ClassVar[Stop] = Stop(iterations=1)

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer the one tour."""
        if not run.proceed():
            return Status.UNKNOWN
        import networkx as nx

        n = problem.size
        graph = nx.Graph()
        rows, columns = np.triu_indices(n, 1)
        weights = problem.costs[rows, columns]
        graph.add_weighted_edges_from(
            zip(rows.tolist(), columns.tolist(), weights.tolist(), strict=True)
        )
        round_trip = np.array(nx.approximation.christofides(graph)[:-1], dtype=np.int64)
        for order in _cuts(problem, round_trip):
            run.offer(order)
        return Status.FEASIBLE


def _cuts(problem: TourProblem, tour: Order) -> list[Order]:
    """Orders that the round trip gives, both ways round."""
    both = [tour, tour[::-1]]
    if problem.start is None and problem.end is None:
        if problem.closed:
            return [tour]
        legs = problem.costs[tour, np.roll(tour, -1)]
        return [np.roll(tour, -1 - int(legs.argmax()))]
    if problem.start is None:
        return [np.roll(way, -1 - int(np.flatnonzero(way == problem.end)[0])) for way in both]
    cuts = [np.roll(way, -int(np.flatnonzero(way == problem.start)[0])) for way in both]
    if problem.end is not None:
        cuts = [np.append(cut[cut != problem.end], problem.end) for cut in cuts]
    return cuts
