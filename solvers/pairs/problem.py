"""Cover by pairs: an element is satisfied by how well pairs of chosen candidates see it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import (
    Floats,
    Ints,
    Singles,
    chosen_indices,
    counts,
    floats,
    read_only,
    singles,
    truths,
)
from solvers.errors import InvalidProblem, InvalidSolution
from solvers.problem import Answer
from solvers.result import Status

Chosen = Ints
"""Sorted indices of the chosen candidates, shape (k,)."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class PairCoverProblem:
    r"""Minimise the price at which enough elements reach a target, or the opposite.

    The value of element ``e`` sums over the pairs of chosen candidates that hit it,

    .. math:: h_e = \sum_{i<j} w(\alpha_{ij}) \min(u_i, u_j) \min(v_i, v_j),

    with the angle :math:`\alpha` between their rays at the element, nearness ``u`` and
    facing ``v`` of each hit. An element is satisfied if its value reaches ``target`` and
    ``fine_demand`` of its hits are fine. Without ``budget``: cheapest choice such that at
    least a ``share`` of the elements that can reach ``target`` are satisfied. With
    ``budget``: fewest of these elements missed at a price of at most ``budget``.

    Rays and factors are kept in single precision, and each pair's term is rounded to a
    multiple of 2**-32, so that sums are the same in any order and can be undone exactly.

    Parameters
    ----------
    covers
        Which candidate hits which element: scipy CSR, shape (candidates, elements), with
        columns ascending and distinct in each row. Its values are not read.
    rays
        Unit vectors from the element to the candidate, one a hit, shape (nnz, 3).
    nearness, facing
        Factors of each hit, shape (nnz,) or one number; what is below 0 counts as 0.
    weights
        Weight of a pair at chords between the two rays' tips evenly spaced from 0 to 2, at
        least 0, shape (k,), k >= 2; in between it is interpolated linearly. The chord of an
        angle is 2 sin(angle / 2); see :func:`solvers.pairs.table.chord_table`.
    target
        Value at which each element is satisfied, positive, shape (elements,) or one number.
    share
        Share of the reachable elements that must be satisfied, in (0, 1].
    budget
        Largest price; turns the question round.
    fine
        Which hits are fine, boolean, shape (nnz,) or one truth value.
    fine_demand
        How many fine hits each element wants, whole, shape (elements,) or one number. What
        all candidates together cannot give is taken off and listed in ``fine_shortfall``.
    prices
        Price of each candidate, at least 0, shape (candidates,) or one number.
    conflicts
        Groups of candidates of which at most one may be chosen.

    Raises
    ------
    InvalidProblem
        If shapes, signs or indices do not fit.

    """

    indptr: Ints
    indices: NDArray[np.int32]
    rays: Singles
    nearness: Singles
    facing: Singles
    weights: Floats
    target: Floats
    share: float
    budget: float | None
    fine: NDArray[np.bool_]
    fine_demand: Ints
    fine_shortfall: Ints
    prices: Floats
    conflicts: tuple[Ints, ...]
    elements: int
    """Number of elements."""

    family: ClassVar[str] = "pairs"

    def __init__(
        self,
        covers: Any,
        rays: Any,
        nearness: Any = 1.0,
        facing: Any = 1.0,
        *,
        weights: Any,
        target: Any,
        share: float = 1.0,
        budget: float | None = None,
        fine: Any = True,
        fine_demand: Any = 0,
        prices: Any = 1.0,
        conflicts: Sequence[Any] = (),
    ) -> None:
        if getattr(covers, "format", None) != "csr":
            raise InvalidProblem("covers must be a scipy CSR matrix (candidates, elements).")
        if not covers.has_canonical_format:
            raise InvalidProblem("covers must have ascending, distinct columns in each row.")
        if not 0.0 < share <= 1.0:
            raise InvalidProblem(f"share must lie in (0, 1], got {share}.")
        if budget is not None and not budget >= 0.0:
            raise InvalidProblem(f"budget must be at least 0, got {budget}.")
        if np.ndim(weights) != 1 or len(weights) < 2:
            raise InvalidProblem("weights must be two numbers or more, at chords from 0 to 2.")
        candidates, elements = (int(size) for size in covers.shape)
        hits = int(covers.nnz)
        goal = floats(target, (elements,), "target")
        if (goal <= 0.0).any():
            raise InvalidProblem(f"target must be positive, got {goal.min()}.")
        unit = singles(rays, (hits, 3), "rays")
        if hits and np.abs(np.einsum("ij,ij->i", unit, unit) - 1.0).max() > 2e-3:
            raise InvalidProblem("rays must have length 1.")
        try:
            groups = tuple(chosen_indices(group, candidates) for group in conflicts)
        except InvalidSolution as error:
            raise InvalidProblem(f"conflicts: {error}") from error
        columns = covers.indices.astype(np.int32)
        marks = truths(fine, (hits,), "fine")
        wanted_fine = counts(fine_demand, (elements,), "fine_demand")
        give_fine = np.minimum(wanted_fine, np.bincount(columns[marks], minlength=elements))
        fields = {
            "indptr": read_only(covers.indptr.astype(np.int64)),
            "indices": read_only(columns),
            "rays": unit,
            "nearness": singles(nearness, (hits,), "nearness"),
            "facing": singles(facing, (hits,), "facing"),
            "weights": floats(weights, (len(weights),), "weights", least=0.0),
            "target": goal,
            "share": float(share),
            "budget": budget,
            "fine": marks,
            "fine_demand": read_only(give_fine.astype(np.int64)),
            "fine_shortfall": read_only((wanted_fine - give_fine).astype(np.int64)),
            "prices": floats(prices, (candidates,), "prices", least=0.0),
            "conflicts": groups,
            "elements": elements,
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"PairCoverProblem({self.candidates} candidates, {self.elements} elements)"

    @property
    def candidates(self) -> int:
        """Number of candidates."""
        return len(self.prices)

    @property
    def features(self) -> frozenset[str]:
        """``conflicts``, ``budget`` and ``share``, where they matter."""
        used = {
            "conflicts": bool(self.conflicts),
            "budget": self.budget is not None,
            "share": self.share < 1.0,
        }
        return frozenset(name for name, present in used.items() if present)

    @cached_property
    def by_element(self) -> tuple[Ints, NDArray[np.int32], NDArray[np.int32]]:
        """Row starts (elements + 1,), hits by element (nnz,), candidate of each hit (nnz,)."""
        from solvers.pairs import kernels

        starts = np.empty(self.elements + 1, dtype=np.int64)
        at, owner = np.empty((2, len(self.indices)), dtype=np.int32)
        kernels.transposed(self.indptr, self.indices, starts, at, owner)
        for array in (starts, at, owner):
            read_only(array)
        return starts, at, owner

    @cached_property
    def sight(self) -> Singles:
        """Ray, nearness and facing of each hit, element by element, shape (5, nnz)."""
        from solvers.pairs import kernels

        sight = np.empty((5, len(self.indices)), dtype=np.float32)
        kernels.gathered(self.by_element[1], self.rays, self.nearness, self.facing, sight)
        return sight

    def values(self, chosen: Chosen) -> Floats:
        """Value of each element under a choice, shape (elements,)."""
        from solvers.pairs import kernels

        hits = (self.indptr, self.indices, self.rays, self.nearness, self.facing)
        rows = np.array(chosen, dtype=np.int64)
        return kernels.values(rows, *hits, self.weights, self.elements)

    def fine_hits(self, chosen: Chosen) -> Ints:
        """How many fine hits each element has under a choice, shape (elements,)."""
        parts = [np.arange(*self.indptr[row : row + 2]) for row in chosen]
        hit = np.concatenate([np.empty(0, dtype=np.int64), *parts])
        element = self.indices[hit[self.fine[hit]]]
        return np.bincount(element, minlength=self.elements).astype(np.int64)

    def satisfied(self, chosen: Chosen) -> NDArray[np.bool_]:
        """Which reachable elements are satisfied by a choice, shape (elements,)."""
        enough = self.fine_hits(chosen) >= self.fine_demand
        return np.asarray((self.values(chosen) >= self.target) & enough & self.reachable)

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """Which elements reach the target when every candidate is chosen, shape (elements,)."""
        from solvers.pairs import kernels

        starts = self.by_element[0]
        reached = kernels.reaches(starts, self.sight, self.weights, self.target)
        read_only(reached)
        return reached

    @property
    def wanted(self) -> int:
        """How many reachable elements must reach the target where there is no budget."""
        return int(np.ceil(self.share * np.count_nonzero(self.reachable) - 1e-9))

    def evaluate(self, candidate: Any) -> tuple[Chosen, float]:
        """Sorted copy of a choice, and its price (or, with a budget, the elements missed).

        Raises
        ------
        InvalidSolution
            If too few elements reach the target, the price is over the budget, or two
            chosen candidates conflict.

        """
        chosen = chosen_indices(candidate, self.candidates)
        for number, group in enumerate(self.conflicts):
            if np.isin(group, chosen).sum() > 1:
                raise InvalidSolution(f"two chosen candidates are both in conflict {number}.")
        price = float(self.prices[chosen].sum())
        satisfied = np.count_nonzero(self.satisfied(chosen))
        if self.budget is not None:
            if price > self.budget:
                raise InvalidSolution(f"the price {price} is over the budget {self.budget}.")
            return chosen, float(np.count_nonzero(self.reachable) - satisfied)
        if satisfied < self.wanted:
            raise InvalidSolution(f"{satisfied} elements reach the target; {self.wanted} must.")
        return chosen, price

    def cost(self, candidate: Any) -> float:
        """Cost of a choice; raises as :meth:`evaluate` does."""
        return self.evaluate(candidate)[1]

    def trivial(self) -> Answer | None:
        """The empty choice, where no element can reach the target."""
        if self.reachable.any():
            return None
        return Answer(Status.OPTIMAL, np.empty(0, dtype=np.int64))
