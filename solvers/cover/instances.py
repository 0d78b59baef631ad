"""Problems from files of the OR-Library, and back; problems from dice."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from solvers.arrays import Floats, Ints
from solvers.cover.problem import Chosen, CoverProblem
from solvers.errors import InvalidProblem

_MOST_BYTES = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """A problem with its name and the cost of its best cover, where that is known.

    Parameters
    ----------
    name
        What tables call it.
    problem
        The cover problem.
    best_known
        Cost that is known to be reached, or ``None``.

    """

    name: str
    problem: CoverProblem
    best_known: float | None = None


def read_orlib(path: str | Path, *, demand: int = 1) -> Instance:
    """Read a set-cover problem of the OR-Library, in any of its three formats.

    All are whole numbers between blanks. *Rows*: number of elements and of sets, the price of
    each set, and for each element how many sets hit it and which. *Rail*: number of elements
    and of sets, and for each set its price, how many elements it hits and which. *Steiner
    triples*: number of sets and of elements, and the three sets, each of price 1, that hit each
    element. Numbering starts at 1. The format is the one that uses up all numbers.

    Parameters
    ----------
    path
        The file; its name without the extension is that of the instance.
    demand
        How many distinct sets each element wants, at least 1; what all sets together cannot
        give is taken off.

    Raises
    ------
    InvalidProblem
        If the file cannot be read, or fits none of the formats; the message names the file.

    """
    path = Path(path)
    numbers = _numbers(path)
    faults = []
    for form, parse in (("rows", _rows), ("rail", _rail), ("Steiner triples", _triples)):
        try:
            prices, owner, element, elements = parse(numbers)
        except _Misfit as misfit:
            faults.append(f"as {form}, {misfit}")
            continue
        try:
            problem = _problem(owner, element, (len(prices), elements), prices, demand)
        except InvalidProblem as error:
            raise InvalidProblem(f"{path}: {error}") from error
        return Instance(path.stem, problem)
    raise InvalidProblem(f"{path}: fits no format of the OR-Library: {'; '.join(faults)}.")


def write_orlib(path: str | Path, problem: CoverProblem) -> None:
    """Write a problem in the *rows* format, prices with all their digits.

    Raises
    ------
    InvalidProblem
        If it has sectors, conflicts or a demand other than 1, which the format cannot say.

    """
    if problem.features or (problem.demand != 1).any():
        raise InvalidProblem("the format knows neither sectors, conflicts nor a demand but 1.")
    rows = problem.covers.T.tocsr()
    rows.sort_indices()
    lines = [f"{problem.elements} {problem.sets}", " ".join(f"{p:.17g}" for p in problem.prices)]
    for element in range(problem.elements):
        sets = 1 + rows.indices[rows.indptr[element] : rows.indptr[element + 1]]
        lines += [str(len(sets)), " ".join(map(str, sets.tolist()))]
    Path(path).write_text("\n".join([*lines, ""]), encoding="utf-8")


def write_cover(path: str | Path, chosen: Chosen, *, cost: float) -> None:
    """Write a cover: its cost and number of sets, then the sets, numbered from 1."""
    sets = " ".join(str(int(j) + 1) for j in chosen)
    Path(path).write_text(f"{cost:.17g} {len(chosen)}\n{sets}\n", encoding="utf-8")


def disc_instance(
    sets: int, elements: int, seed: int, *, hits: float = 45.0, spread: float = 0.0, demand: int = 2
) -> Instance:
    """Elements are places in a square, sets the discs around others; all prices are 1.

    Like photos and samples of a surface: neighbours see nearly the same.

    Parameters
    ----------
    sets, elements
        How many, at least 1.
    seed
        The same seed gives the same places.
    hits
        How many elements a disc holds away from the edge of the square, on average.
    spread
        Areas of discs lie evenly within this share of their mean, in [0, 1].
    demand
        How many distinct sets each element wants; less where there are fewer.

    """
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(seed)
    places, middles = rng.random((elements, 2)), rng.random((sets, 2))
    share = rng.uniform(1.0 - spread, 1.0 + spread, sets) if spread else np.ones(sets)
    radius = np.sqrt(share * hits / (np.pi * elements))
    tree: Any = cKDTree(places)
    inside = tree.query_ball_point(middles, radius, return_sorted=True)
    owner = np.repeat(np.arange(sets), [len(held) for held in inside])
    element = np.concatenate([np.asarray(held, dtype=np.int64) for held in inside])
    problem = _problem(owner, element, (sets, elements), np.ones(sets), demand)
    kind = f"discs-{spread:g}" if spread else "discs"
    return Instance(f"{kind}-{sets}-{elements}-{seed}", problem)


def planted_instance(sets: int, elements: int, seed: int, *, parts: int = 20) -> Instance:
    """A partition of the elements among other sets, so that the least number of sets is known.

    No set is larger than ``elements / parts``, so no cover has fewer than ``parts`` sets, and
    the partition has that many. Prices are 1.

    Parameters
    ----------
    sets
        How many, at least ``parts``.
    elements
        How many, a multiple of ``parts``.
    seed
        The same seed gives the same sets.
    parts
        Size of the best cover, at least 1.

    Raises
    ------
    InvalidProblem
        If the numbers do not fit.

    """
    if parts < 1 or sets < parts or elements % parts:
        raise InvalidProblem(
            f"{sets} sets and {elements} elements cannot hold a partition into {parts} parts."
        )
    rng = np.random.default_rng(seed)
    largest = elements // parts
    planted = rng.permutation(elements).reshape(parts, largest)
    decoys = [rng.choice(elements, largest, replace=False) for _ in range(sets - parts)]
    element = np.concatenate([planted.ravel(), *decoys])
    owner = rng.permutation(sets).repeat(largest)
    shape = (sets, elements)
    problem = _problem(owner, element, shape, np.ones(sets), 1)
    return Instance(f"planted-{sets}-{elements}-{parts}-{seed}", problem, float(parts))


class _Misfit(Exception):
    """The numbers are not in this format."""


def _numbers(path: Path) -> Floats:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise InvalidProblem(f"{path}: larger than {_MOST_BYTES} bytes.")
        words = path.read_text(encoding="utf-8", errors="replace").split()
    except OSError as error:
        raise InvalidProblem(f"{path}: cannot be read: {error.strerror}.") from error
    try:
        numbers = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise InvalidProblem(f"{path}: holds something that is no number: {error}.") from error
    if len(numbers) < 2 or not np.isfinite(numbers).all():
        raise InvalidProblem(f"{path}: wants two finite numbers or more.")
    return numbers


def _rows(numbers: Floats) -> tuple[Floats, Ints, Ints, int]:
    """Prices, set and element of each hit, and how many elements, of the *rows* format."""
    elements, sets = _sizes(numbers)
    prices, rest = numbers[2 : 2 + sets], numbers[2 + sets :]
    if len(prices) < sets:
        raise _Misfit(f"{sets} prices are wanted and {len(prices)} there")
    counts, members, after = _lists(rest, elements, lead=0)
    if after != len(rest):
        raise _Misfit(f"{len(rest) - after} numbers are left over")
    return prices, _indices(members, sets, "set"), np.repeat(np.arange(elements), counts), elements


def _rail(numbers: Floats) -> tuple[Floats, Ints, Ints, int]:
    """The same of the *rail* format."""
    elements, sets = _sizes(numbers)
    rest = numbers[2:]
    counts, members, after = _lists(rest, sets, lead=1)
    if after != len(rest):
        raise _Misfit(f"{len(rest) - after} numbers are left over")
    starts = np.concatenate([[0], np.cumsum(counts + 2)[:-1]])
    owner = np.repeat(np.arange(sets), counts)
    return rest[starts], owner, _indices(members, elements, "element"), elements


def _triples(numbers: Floats) -> tuple[Floats, Ints, Ints, int]:
    """The same of Steiner triples."""
    sets, elements = _sizes(numbers)
    if len(numbers) != 2 + 3 * elements:
        raise _Misfit(f"{3 * elements} numbers are wanted and {len(numbers) - 2} there")
    owner = _indices(numbers[2:], sets, "set")
    return np.ones(sets), owner, np.repeat(np.arange(elements), 3), elements


def _sizes(numbers: Floats) -> tuple[int, int]:
    first, second = numbers[:2].tolist()
    for size in (first, second):
        if not (1 <= size <= len(numbers) and size == int(size)):  # none without a number
            raise _Misfit(f"{size:.10g} is no size of what {len(numbers)} numbers can tell")
    return int(first), int(second)


def _lists(numbers: Floats, count: int, *, lead: int) -> tuple[Ints, Floats, int]:
    """Length and content of ``count`` lists, each after ``lead`` numbers and its length."""
    lengths, parts, at = [], [], 0
    for one in range(count):
        at += lead
        if at >= len(numbers):
            raise _Misfit(f"it ends after {one} of {count} lists")
        length = float(numbers[at])
        if not (length >= 0 and length == int(length) and at + 1 + length <= len(numbers)):
            raise _Misfit(f"list {one + 1} cannot be {length:g} long")
        lengths.append(int(length))
        parts.append(numbers[at + 1 : at + 1 + int(length)])
        at += 1 + int(length)
    return np.array(lengths, dtype=np.int64), np.concatenate([*parts, np.zeros(0)]), at


def _indices(members: Floats, size: int, what: str) -> Ints:
    whole = members.astype(np.int64) - 1
    wrong = np.flatnonzero((whole + 1 != members) | (whole < 0) | (whole >= size))
    if wrong.size:
        raise _Misfit(f"{members[wrong[0]]:g} is no {what} of {size}")
    return whole


def _problem(
    owner: Ints, element: Ints, shape: tuple[int, int], prices: Floats, demand: int
) -> CoverProblem:
    from scipy.sparse import coo_array

    ones = np.ones(len(owner), dtype=np.int32)
    return CoverProblem(coo_array((ones, (owner, element)), shape=shape), prices, demand)
