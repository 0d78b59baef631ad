"""Race solvers against each other: every instance, every solver, every seed."""

import dataclasses
import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from solvers.comparison import Comparison, Trial
from solvers.errors import InvalidProblem, SolverError
from solvers.front import FALLBACK_STOP, solve
from solvers.problem import Problem, Solver
from solvers.registry import families, load
from solvers.result import StopReason
from solvers.stop import Stop

T = TypeVar("T")
R = TypeVar("R")


class Mapper(Protocol):
    """``map`` and everything that looks like it: that of a pool, of an executor."""

    def __call__(self, function: Callable[[T], R], items: Iterable[T], /) -> Iterable[R]:
        """Apply the function to every item; results in the order of the items."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A problem with the name that tables give it, and the best cost known for it."""

    name: str
    problem: Problem[Any]
    best_known: float | None = None


def compare(
    problems: Mapping[str, Problem[Any]] | Iterable[Any],
    solvers: Mapping[str, str | Solver] | Iterable[str | Solver],
    seeds: Iterable[int] = (0,),
    stop: Stop = Stop(),  # noqa: B008 - an immutable value
    *,
    best_known: Mapping[str, float] | None = None,
    until_best: bool = False,
    map: Mapper = map,  # noqa: A002 - what is like it may stand in for it
    listener: Callable[[Trial], None] | None = None,
) -> Comparison:
    """Run every solver on every problem with every seed, and tabulate what came out.

    A solver that is missing, refuses the problem or crashes is a row with its reason; where it
    takes a process of a pool down with it, so are all runs that were not over. Who runs what
    where changes nothing but the seconds, and these are charged for little compilation: each
    solver first runs for a moment on a small problem of the family. Ctrl-C ends the race; what has
    been run by then is in the table.

    Parameters
    ----------
    problems
        Name -> problem, or an iterable of problems and of whatever has a ``name`` and a
        ``problem``, such as what the ``instances`` modules read and make; its
        ``best_known``, if it has one, counts.
    solvers
        Label -> solver, or solvers as :func:`solvers.solve` takes them. An object's label is
        its name and those of its parameters that are not the default.
    seeds
        One run each.
    stop
        Limits of each run; with none set, each solver's own default.
    best_known
        Name of an instance -> best cost known, instead of what the instance itself says; without
        either, tables measure from the best cost that any solver found.
    until_best
        Whether a run also ends once it reaches the best cost known, where one is: the seconds
        are then the time to that target, and no gap changes. Needs another limit besides.
    map
        How to spread the runs, such as ``ProcessPoolExecutor().map``; everything that travels
        pickles if the problems do.
    listener
        Called with every trial that has run, in order.

    Raises
    ------
    InvalidProblem
        If there is nothing to compare, two instances or solvers share a name, or a run until
        the best has no other limit.

    """
    cases = tuple(_cases(problems))
    entrants = _labelled(solvers)
    seeds = tuple(map(_seed, seeds))
    if not (cases and entrants and seeds):
        raise InvalidProblem(
            "a comparison needs a problem, a solver and a seed, at least one each."
        )
    if until_best and not stop.limits - {"target"}:
        raise InvalidProblem("a run until the best cost known needs another limit besides.")
    known = {case.name: case.best_known for case in cases if case.best_known is not None}
    known |= dict(best_known or {})
    known = {name: _cost(name, cost) for name, cost in known.items()}
    aim = -math.inf if stop.target is None else stop.target
    stops = {
        case.name: dataclasses.replace(stop, target=max(aim, known[case.name]))
        for case in cases
        if until_best and case.name in known
    }
    jobs = [
        _Job(case.name, case.problem, label, solver, seed, stops.get(case.name, stop))
        for case in cases
        for label, solver in entrants.items()
        for seed in seeds
    ]
    trials: list[Trial] = []
    try:
        for trial in map(_trial, jobs):
            trials.append(trial)
            if listener is not None:
                listener(trial)
            if trial.result is not None and trial.result.stop_reason is StopReason.INTERRUPTED:
                break
    except KeyboardInterrupt:
        pass  # pressed between two runs, or while others worked
    except BrokenExecutor as error:  # a solver took its process down, and the whole pool with it
        why = f"a process died before this run was over: {error}"
        rest = jobs[len(trials) :]
        trials += [Trial(job.instance, job.label, job.seed, None, why) for job in rest]
    return Comparison(tuple(trials), known, interrupted=len(trials) < len(jobs))


@dataclass(frozen=True, slots=True, eq=False)
class _Job:
    """One run to be made, here or in another process."""

    instance: str
    problem: Any
    label: str
    solver: str | Solver
    seed: int
    stop: Stop


_warm: set[tuple[str, str]] = set()  # families and solvers that have run in this process
_WARM_UP = 4  # runs of a second that may go into compiling


def _trial(job: _Job) -> Trial:
    try:
        _warm_up(job)
        result = solve(job.problem, job.solver, seed=job.seed, stop=job.stop)
    except SolverError as error:
        return Trial(job.instance, job.label, job.seed, None, str(error))
    return Trial(job.instance, job.label, job.seed, result)


def _warm_up(job: _Job) -> None:
    """Let a solver load and compile on a small problem, until a run takes less than a second."""
    from solvers.known_problems import larger_problem

    family = job.problem.family
    if (family, repr(job.solver)) in _warm or family not in families():
        return
    _warm.add((family, repr(job.solver)))
    problem = larger_problem(family)
    with suppress(SolverError):  # the run itself will say it
        solver = load(family, job.solver)
        default = getattr(solver, "default_stop", FALLBACK_STOP)
        usual = default(problem) if callable(default) else default
        for stop in (Stop(iterations=1), *[dataclasses.replace(usual, seconds=1.0)] * _WARM_UP):
            result = solve(problem, solver, stop=stop)
            if result.stop_reason is StopReason.INTERRUPTED:
                raise KeyboardInterrupt
            if stop.seconds is not None and result.seconds < stop.seconds:
                break


def _seed(seed: Any) -> int:
    try:
        return operator.index(seed)
    except TypeError as error:
        raise InvalidProblem(f"a seed must be a whole number, got {seed!r}.") from error


def _cost(name: str, cost: Any) -> float:
    try:
        known = float(cost)
    except (TypeError, ValueError) as error:
        raise InvalidProblem(f"{name}: the best cost known is no number: {cost!r}.") from error
    if math.isnan(known):
        raise InvalidProblem(f"{name}: the best cost known is no number: {cost!r}.")
    return known


def _cases(problems: Any) -> Iterator[Case]:
    taken: set[str] = set()
    pairs = problems.items() if isinstance(problems, Mapping) else enumerate(problems, start=1)
    for key, given in pairs:
        named = hasattr(given, "problem")
        name = str(given.name if named else key)
        if name in taken:
            raise InvalidProblem(f"two instances are called {name!r}.")
        taken.add(name)
        problem = given.problem if named else given
        if not isinstance(getattr(problem, "family", None), str):
            raise InvalidProblem(f"instance {name!r} is no problem of any family: {problem!r}.")
        yield Case(name, problem, getattr(given, "best_known", None))


def _labelled(solvers: Any) -> dict[str, str | Solver]:
    if isinstance(solvers, Mapping):
        return dict(solvers)
    if isinstance(solvers, str):
        raise InvalidProblem(f"solvers must be a list of names, got the one text {solvers!r}.")
    labelled: dict[str, str | Solver] = {}
    for solver in solvers:
        label = solver if isinstance(solver, str) else label_of(solver)
        if label in labelled:
            raise InvalidProblem(f"two solvers are called {label!r}; give them as a mapping.")
        labelled[label] = solver
    return labelled


def label_of(solver: Any) -> str:
    """Name of a solver and its parameters that are not the default: ``two-opt neighbours=5``."""
    words = [str(solver.name)]
    if dataclasses.is_dataclass(solver):
        for field in dataclasses.fields(solver):
            value = getattr(solver, field.name)
            if field.default is dataclasses.MISSING or repr(value) != repr(field.default):
                words.append(f"{field.name}={value}")
    return " ".join(words)
