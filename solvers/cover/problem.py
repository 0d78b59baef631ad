"""Set multi-cover with prices, conflicts and directions of hits."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from solvers.arrays import Floats, Ints, chosen_indices, counts, floats, read_only
from solvers.errors import InvalidProblem, InvalidSolution
from solvers.problem import Answer
from solvers.result import Status

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Chosen = Ints
"""Sorted indices of the chosen sets, shape (k,)."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class CoverProblem:
    r"""Minimise the price of the chosen sets such that each element is hit often enough.

    .. math::
        \min \sum_j p_j x_j, \quad
        \sum_{j \ni e} x_j \ge d_e, \quad
        \sum_s \min\Big(1, \sum_{j \ni e,\, s_{je} = s} x_j\Big) \ge m_e, \quad
        \sum_{j \in C} x_j \le 1 \;\forall C, \quad x_j \in \{0, 1\}

    Element ``e`` wants ``demand[e]`` distinct sets and, where hits carry a sector (the
    direction that the hit comes from), hits in ``sector_demand[e]`` distinct sectors.
    Either demand may be 0. What all sets together cannot give is taken off both demands
    and listed in :attr:`shortfall` and :attr:`sector_shortfall`; solvers see what is left.

    Parameters
    ----------
    covers
        Which set hits which element, shape (sets, elements): a scipy sparse matrix, whose
        stored non-zeros are the hits, or a dense array.
    prices
        Price of each set, at least 0, shape (sets,) or one number.
    demand
        How many distinct sets each element wants, whole, shape (elements,) or one number.
    sectors
        Sector of each hit, whole numbers from 0, shape (nnz,), in the order of the stored
        entries of ``covers`` (which must then be CSR without stored zeros or repeats).
    sector_demand
        How many distinct sectors each element wants to be hit from, as ``demand``.
    conflicts
        Groups of sets of which at most one may be chosen; they may overlap.

    Raises
    ------
    InvalidProblem
        If shapes, signs or indices do not fit.

    """

    indptr: Ints
    """Start of each set's hits in ``indices``, shape (sets + 1,)."""
    indices: NDArray[np.int32]
    """Elements hit, set by set, ascending within each, shape (nnz,)."""
    sectors: NDArray[np.int16] | None
    """Sector of each hit in the same order, or ``None`` where no element wants any."""
    prices: Floats
    demand: Ints
    sector_demand: Ints
    shortfall: Ints
    sector_shortfall: Ints
    conflicts: tuple[Ints, ...]

    family: ClassVar[str] = "cover"

    def __init__(
        self,
        covers: Any,
        prices: Any = 1.0,
        demand: Any = 1,
        *,
        sectors: Any = None,
        sector_demand: Any = 0,
        conflicts: Sequence[Any] = (),
    ) -> None:
        shape, indptr, indices, marks = _hits(covers, sectors)
        sets, elements = shape
        wanted = counts(demand, (elements,), "demand")
        wanted_sectors = counts(sector_demand, (elements,), "sector_demand")
        if marks is None and wanted_sectors.any():
            raise InvalidProblem("sector_demand needs the sector of each hit: give `sectors`.")
        if not wanted_sectors.any():
            marks = None
        give = np.minimum(wanted, np.bincount(indices, minlength=elements))
        give_sectors = wanted_sectors
        if marks is not None:
            seen = np.zeros((elements, int(marks.max(initial=0)) + 1), dtype=np.bool_)
            seen[indices, marks] = True
            give_sectors = np.minimum(wanted_sectors, np.count_nonzero(seen, axis=1))
        fields = {
            "indptr": indptr,
            "indices": indices,
            "sectors": marks,
            "prices": floats(prices, (sets,), "prices", least=0.0),
            "demand": give.astype(np.int64),
            "sector_demand": give_sectors.astype(np.int64),
            "shortfall": (wanted - give).astype(np.int64),
            "sector_shortfall": (wanted_sectors - give_sectors).astype(np.int64),
            "conflicts": tuple(_clique(group, sets) for group in conflicts),
        }
        for name, value in fields.items():
            if isinstance(value, np.ndarray):
                read_only(value)
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"CoverProblem({self.sets} sets, {self.elements} elements, {len(self.indices)} hits)"

    @property
    def sets(self) -> int:
        """Number of sets."""
        return len(self.prices)

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.demand)

    @property
    def sector_count(self) -> int:
        """Number of sectors told apart, 0 if none."""
        return 0 if self.sectors is None else int(self.sectors.max(initial=0)) + 1

    @cached_property
    def covers(self) -> "csr_array[Any]":
        """Hits as ones, int32 (bool @ bool would stay bool), shape (sets, elements)."""
        from scipy.sparse import csr_array

        ones = np.ones(len(self.indices), dtype=np.int32)
        return csr_array((ones, self.indices, self.indptr), shape=(self.sets, self.elements))

    @property
    def features(self) -> frozenset[str]:
        """``sectors`` and ``conflicts``, where they matter."""
        used = {"sectors": self.sectors is not None, "conflicts": bool(self.conflicts)}
        return frozenset(name for name, present in used.items() if present)

    def hits(self, chosen: Chosen) -> NDArray[np.int64]:
        """Positions in ``indices`` of every hit of the chosen sets, shape (hits,)."""
        starts, ends = self.indptr[chosen], self.indptr[chosen + 1]
        lengths = ends - starts
        offsets = np.repeat(starts - np.concatenate(([0], np.cumsum(lengths)[:-1])), lengths)
        return offsets + np.arange(lengths.sum()) if len(chosen) else np.empty(0, dtype=np.int64)

    def coverage(self, chosen: Chosen) -> Ints:
        """How many of the chosen sets hit each element, shape (elements,)."""
        hit = self.indices[self.hits(chosen)]
        return np.bincount(hit, minlength=self.elements).astype(np.int64, copy=False)

    def sector_coverage(self, chosen: Chosen) -> Ints:
        """From how many distinct sectors each element is hit, shape (elements,)."""
        if self.sectors is None:
            return np.zeros(self.elements, dtype=np.int64)
        at = self.hits(chosen)
        seen = np.zeros((self.elements, self.sector_count), dtype=np.bool_)
        seen[self.indices[at], self.sectors[at]] = True
        return np.asarray(np.count_nonzero(seen, axis=1), dtype=np.int64)

    def evaluate(self, candidate: Any) -> tuple[Chosen, float]:
        """Sorted copy of a selection, and its price.

        Raises
        ------
        InvalidSolution
            If an element lacks hits or sectors, or two chosen sets conflict.

        """
        chosen = chosen_indices(candidate, self.sets)
        lacking = np.flatnonzero(self.coverage(chosen) < self.demand)
        if lacking.size:
            raise InvalidSolution(f"{lacking.size} elements lack hits, the first is {lacking[0]}.")
        lacking = np.flatnonzero(self.sector_coverage(chosen) < self.sector_demand)
        if lacking.size:
            raise InvalidSolution(
                f"{lacking.size} elements lack sectors, the first is {lacking[0]}."
            )
        if self.conflicts:
            taken = np.zeros(self.sets, dtype=np.bool_)
            taken[chosen] = True
            owner = np.repeat(np.arange(len(self.conflicts)), [len(g) for g in self.conflicts])
            crowded = np.bincount(owner[taken[np.concatenate(self.conflicts)]]) > 1
            if crowded.any():
                raise InvalidSolution(f"two chosen sets are in conflict {np.argmax(crowded)}.")
        return chosen, float(self.prices[chosen].sum())

    def cost(self, candidate: Any) -> float:
        """Price of a selection; raises as :meth:`evaluate` does."""
        return self.evaluate(candidate)[1]

    def trivial(self) -> Answer | None:
        """The empty selection, where nothing is demanded."""
        if self.demand.any() or self.sector_demand.any():
            return None
        return Answer(Status.OPTIMAL, np.empty(0, dtype=np.int64))


def _hits(
    covers: Any, sectors: Any
) -> tuple[tuple[int, int], Ints, NDArray[np.int32], NDArray[np.int16] | None]:
    """Shape, row starts, columns and sectors of the hits, columns ascending in each row."""
    from scipy.sparse import csr_array, issparse

    if not issparse(covers):
        if sectors is not None:
            raise InvalidProblem("with sectors, covers must be a sparse CSR matrix.")
        try:
            covers = np.asarray(covers, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InvalidProblem(f"covers must be a matrix of numbers: {error}") from error
        if covers.ndim != 2:
            raise InvalidProblem(f"covers must be (sets, elements), got shape {covers.shape}.")
        if np.isnan(covers).any():
            raise InvalidProblem("covers must hold no nan.")
        covers = covers != 0
    if sectors is None:
        plain = csr_array(covers, copy=True)
        plain.sum_duplicates()
        plain.eliminate_zeros()
        shape = (int(plain.shape[0]), int(plain.shape[1]))
        return shape, plain.indptr.astype(np.int64), plain.indices.astype(np.int32), None

    if covers.format != "csr":
        raise InvalidProblem(f"with sectors, covers must be CSR, got {covers.format}.")
    marks = counts(sectors, (covers.nnz,), "sectors")
    if marks.max(initial=0) > np.iinfo(np.int16).max:
        raise InvalidProblem(f"sectors must lie below 32768, got {marks.max()}.")
    if not np.asarray(covers.data).all():
        raise InvalidProblem("with sectors, covers must not store zeros.")
    # Sector + 1 travels as the value, so that sorting a row's columns keeps them together.
    tagged = csr_array((marks + 1, covers.indices, covers.indptr), shape=covers.shape, copy=True)
    tagged.sort_indices()
    columns, starts = tagged.indices, tagged.indptr.astype(np.int64)
    again = columns[1:] == columns[:-1]
    again[starts[(starts > 0) & (starts < len(columns))] - 1] = False  # across two rows
    if again.any():
        raise InvalidProblem("with sectors, a set may hit an element only once.")
    shape = (int(covers.shape[0]), int(covers.shape[1]))
    return shape, starts, columns.astype(np.int32), (tagged.data - 1).astype(np.int16)


def _clique(group: Any, sets: int) -> Ints:
    try:
        return chosen_indices(group, sets)
    except InvalidSolution as error:
        raise InvalidProblem(f"conflicts: {error}") from error
