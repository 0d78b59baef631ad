"""Exact tours by branch and bound on 1-trees."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import Floats
from solvers.parameters import check_whole
from solvers.result import Status, StopReason
from solvers.run import Run
from solvers.stop import Stop
from solvers.tour.bounds import SAME, Ascent, ascents, grain, proves, rounded_up
from solvers.tour.closing import Closing, closing, opened
from solvers.tour.iterated import IteratedLocalSearch
from solvers.tour.limits import part
from solvers.tour.problem import Order, TourProblem

if TYPE_CHECKING:
    from solvers.tour.edge_kernels import Edges

_ASCENT = 1500  # steps at the root: until it comes to rest
_EDGES_A_BATCH = 20_000  # edges times nodes between two looks at the limits
_MOST_EDGES = 100_000  # with more, a node alone takes seconds
_FRAMES = 256  # decisions that there is room for at first


@dataclass(frozen=True, slots=True)
class BranchAndBound:
    """Prove the best tour: 1-trees bound, edges are decided one by one, depth first.

    First some kicks of iterated local search, within half of the limits, give a good tour; the
    ascent of Held and Karp then gives a bound and the few edges that a better tour can have.
    At each node the ascent goes on; edges that no better tour can have or lack are decided at
    once, and the search branches on the edge that raises both bounds most, of a few that about
    half of the recent 1-trees had. An iteration is one kick, and later one node. Where bound and
    tour are so far apart that more than 100,000 edges are left, it comes to an end with them.

    Parameters
    ----------
    kicks
        Kicks of the local search before, for each place; from 0.
    steps
        Steps of the ascent at a node, at least 1.
    tries
        Edges to try before each branching, at least 1.
    trial_steps
        Steps of the ascent in each trial, at least 1.

    References
    ----------
    Held and Karp, 1971, doi:10.1007/BF01584070; Volgenant and Jonker, 1982,
    doi:10.1016/0377-2217(82)90015-7.

    """

    kicks: int = 50
    steps: int = 20
    tries: int = 5
    trial_steps: int = 8
    name: ClassVar[str] = "branch-and-bound"
    requires: ClassVar[tuple[str, ...]] = ("numba",)
    cannot: ClassVar[frozenset[str]] = frozenset({"asymmetric"})
    exact: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_whole(self, kicks=0, steps=1, tries=1, trial_steps=1)

    def default_stop(self, problem: TourProblem) -> Stop:
        """All the kicks and 20,000 nodes."""
        return Stop(iterations=2 * self.kicks * problem.size + 20_000)

    def run(self, problem: TourProblem, run: Run[Order]) -> Status:
        """Offer each better tour; optimal when the search is over."""
        with part(run, 0.5, most=1 + self.kicks * problem.size):
            IteratedLocalSearch().run(problem, run)
        return Status.UNKNOWN if run.best is None else self.prove(problem, run)

    def prove(self, problem: TourProblem, run: Run[Order], *, weight: int = 1) -> Status:
        """Go on from the incumbent of a run; a node counts as ``weight`` iterations."""
        from solvers.tour.branch_kernels import new_trees
        from solvers.tour.edge_kernels import no_decisions
        from solvers.tour.proof_kernels import new_frames, open_bound, prove, with_room

        first = run.best_cost
        whole = closing(problem, first)
        unit, extra = grain(problem.costs, whole.dearest), whole.surcharge
        ascent = _root(whole, run, unit)
        if proves(run.bound, run.best_cost, unit):
            return Status.OPTIMAL
        slack = 1e-6 * unit if unit > 0.0 else SAME * run.best_cost
        upper = np.array([run.best_cost + extra])
        done = -unit + slack if unit > 0.0 else -slack  # what a node's bound may fall short by
        edges = _edges(whole.costs, ascent, upper[0] + done)
        decided, tour = no_decisions(edges), np.zeros(len(edges.cost), dtype=np.bool_)
        if decided.left.min() < 2:
            return Status.OPTIMAL  # a better tour would lack edges
        if len(edges.cost) > _MOST_EDGES:
            run.stop_reason = run.limit() or StopReason.FINISHED
            return Status.FEASIBLE
        trees = new_trees(edges, ascent.prices)
        frames = new_frames(_FRAMES, len(ascent.prices))
        while frames.at[0] >= 0:
            nodes = _allowed(run, len(edges.cost), weight)
            if nodes == 0 or not run.proceed():
                run.stop_reason = run.limit() or StopReason.ITERATIONS
                return Status.FEASIBLE
            before = upper[0]
            looked = prove(
                edges, decided, trees, frames, upper, tour, unit, slack, nodes,
                self.steps, self.tries, self.trial_steps,
            )  # fmt: skip
            run.iteration += max(0, looked * weight - 1)
            frames = with_room(frames)
            if upper[0] < before:
                run.offer(opened(problem, _walked(edges, tour)))
                if run.best_cost < 0.5 * first:  # its numbers can be told apart far better
                    return self.prove(problem, run, weight=weight)
            if frames.at[0] > 0:
                left = open_bound(frames, upper[0] + done)
                run.bound = max(run.bound, rounded_up(left - extra, unit))
        return Status.OPTIMAL


def _root(whole: Closing, run: Run[Order], unit: float) -> Ascent:
    """Bound and prices before any decision, even where no time is left."""
    steps = ascents(whole, run.best_cost, _ASCENT)
    ascent = next(steps)
    while run.remaining > 0.0 and (better := next(steps, None)) is not None:
        ascent = better
    run.bound = max(run.bound, rounded_up(ascent.bound - whole.surcharge, unit))
    return ascent


def _edges(costs: Floats, ascent: Ascent, cutoff: float) -> "Edges":
    """Edges that a tour below the cutoff can have, by the prices of the root."""
    from solvers.tour.edge_kernels import new_edges
    from solvers.tour.one_tree_kernels import new_one_tree, one_tree, spare

    tree = new_one_tree(len(costs))
    bound = one_tree(costs, ascent.prices, tree)
    possible = np.triu(bound + spare(costs, ascent.prices, tree) < cutoff, 1)
    one, other = np.nonzero(possible)
    return new_edges(one, other, costs[one, other], len(costs))


def _allowed(run: Run[Order], edges: int, weight: int) -> int:
    """Nodes until the next look at the limits; 0 if the limit on iterations leaves none."""
    nodes = max(1, _EDGES_A_BATCH // edges)
    if run.stop.stall is not None:
        nodes = min(nodes, max(1, run.stop.stall // weight))
    if run.stop.iterations is not None:
        nodes = min(nodes, (run.stop.iterations - run.iteration) // weight)
    return nodes


def _walked(edges: "Edges", inside: NDArray[np.bool_]) -> Order:
    """Closed tour along the edges inside."""
    beside: dict[int, list[int]] = {}
    for one, other in zip(edges.one[inside].tolist(), edges.other[inside].tolist(), strict=True):
        beside.setdefault(one, []).append(other)
        beside.setdefault(other, []).append(one)
    tour, before = [0], -1
    while len(tour) < len(beside):
        one, other = beside[tour[-1]]
        tour, before = [*tour, other if one == before else one], tour[-1]
    return np.array(tour, dtype=np.int64)
