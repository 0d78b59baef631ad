"""Named problems from files and generators, and solvers with parameters, from plain words.

What a command line or a settings file can say: ``berlin52.tsp``, ``random:200:3``, and
``two-opt neighbours=5``.
"""

import json
import re
import shlex
import tomllib
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from solvers.compare import Case
from solvers.errors import InvalidProblem, SolverError
from solvers.problem import Solver
from solvers.registry import families, load, names

READERS = {
    "tour": "solvers.tour.instances:read_tsplib",
    "cover": "solvers.cover.instances:read_orlib",
}
"""Family -> what reads one file into something with a ``name`` and a ``problem``."""

_MOST_BYTES = 100_000_000  # of a file with best known costs
_GENERATED = re.compile(r"([a-z-]+):(\d+)(?::(\d+)(?:-(\d+))?)?")


def cases(family: str, words: Sequence[str]) -> list[Case]:
    """Instances that words name: files, or generators such as ``random:200:0-4``.

    A generator is its name, the size, and a seed or a range of seeds (0 if left out):
    ``random`` for tours, covers and pairs, ``boxes`` for motions. Without any word, one
    generated instance. Best known costs come from ``best_known.json`` beside a file: name of
    the instance -> cost, or -> an object with ``best_known``, alone or under ``instances``.

    Raises
    ------
    InvalidProblem
        If the family, a file or a generator is not there, or a file is broken.

    """
    if family not in families():
        raise InvalidProblem(f"no problem family {family!r}; there are {', '.join(families())}.")
    default = next(f"{name}:{size}" for name, (size, _) in GENERATORS[family].items())
    return list(chain.from_iterable(_named(family, word) for word in words or [default]))


def entrants(family: str, words: Sequence[str]) -> dict[str, str | Solver]:
    """Label -> solver, for names that may be followed by parameters; without any, all there are.

    A parameter is written ``field=value`` with a value as in TOML, or else a text. What is
    registered and yet cannot be loaded stays a name, for the comparison to say why.

    Raises
    ------
    InvalidProblem
        If no solver of the family has that name, or it refuses its parameters.

    """
    found: dict[str, str | Solver] = {}
    for word in words or names(family):
        name, *settings = _words(word)
        try:
            solver = load(family, name, **dict(_parameter(setting) for setting in settings))
        except SolverError:
            if settings or name not in names(family):
                raise
            solver = name
        found[word] = solver
    return found


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text) or [""]
    except ValueError as error:
        raise InvalidProblem(f"{text} is no solver with parameters: {error}.") from error


def _named(family: str, word: str) -> Iterator[Case]:
    if Path(word).exists():
        yield from _read(family, Path(word))
        return
    made = _GENERATED.fullmatch(word)
    known = GENERATORS[family]
    if made is None or made[1] not in known:
        forms = ", ".join(f"{name}:{size}" for name, (size, _) in known.items())
        raise InvalidProblem(f"{word}: no such file, and no generator; there are {forms} (:SEED).")
    first = int(made[3] or 0)
    last = int(made[4] or first)
    if last < first:
        raise InvalidProblem(f"{word}: seeds go up; write {made[1]}:{made[2]}:{last}-{first}.")
    for seed in range(first, last + 1):
        yield known[made[1]][1](int(made[2]), seed)


def _read(family: str, path: Path) -> Iterator[Case]:
    if family not in READERS:
        raise InvalidProblem(f"{path}: there is no file format for family {family!r}.")
    module, _, function = READERS[family].partition(":")
    instance = getattr(import_module(module), function)(path)
    best = _best_known(path.parent / "best_known.json").get(instance.name)
    yield Case(instance.name, instance.problem, best)


def _best_known(path: Path) -> dict[str, float]:
    if not path.is_file():
        return {}
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise ValueError("it is too large")
        content = json.loads(path.read_text(encoding="utf-8"))
        listed = content.get("instances", content)
        costs = {
            name: entry.get("best_known") if isinstance(entry, dict) else entry
            for name, entry in listed.items()
        }
        return {name: float(cost) for name, cost in costs.items() if isinstance(cost, int | float)}
    except (OSError, ValueError, AttributeError, RecursionError) as error:
        raise InvalidProblem(f"{path} is no list of best known costs: {error}") from error


def _parameter(setting: str) -> tuple[str, Any]:
    field, sign, text = setting.partition("=")
    if not sign or not field.isidentifier():
        raise InvalidProblem(f"{setting!r} is no parameter; write it as field=value.")
    try:
        return field, tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return field, text


def _random_tour(size: int, seed: int) -> Case:
    """Places in a square of side 1000."""
    from solvers.tour.instances import random_instance

    instance = random_instance(size, seed)
    return Case(instance.name, instance.problem)


def _random_cover(size: int, seed: int) -> Case:
    """Places in a unit square; each set is a disc that holds about thirty of them."""
    from solvers.cover.problem import CoverProblem

    rng = np.random.default_rng(seed)
    places, middles = rng.random((size, 2)), rng.random((size, 2))
    apart = np.linalg.norm(middles[:, None] - places[None, :], axis=2)
    hits = apart < np.sqrt(30.0 / (np.pi * max(size, 30)))
    return Case(f"random-{size}-{seed}", CoverProblem(hits, rng.integers(1, 10, size), 2))


def _random_pairs(size: int, seed: int) -> Case:
    from solvers.known_problems import pair_problem

    return Case(f"random-{size}-{seed}", pair_problem(size, 2 * size, 0.5, seed=seed))


def _boxes(size: int, seed: int) -> Case:
    from solvers.motion.instances import random_boxes

    instance = random_boxes(seed, boxes=size)
    return Case(instance.name, instance.problem, instance.best_known)


GENERATORS: dict[str, dict[str, tuple[int, Callable[[int, int], Case]]]] = {
    "cover": {"random": (200, _random_cover)},
    "pairs": {"random": (40, _random_pairs)},
    "tour": {"random": (100, _random_tour)},
    "motion": {"boxes": (10, _boxes)},
}
"""Family -> name -> size where none is given, and what makes a case of a size and a seed."""
