"""Race solvers against each other: every instance, every solver, every seed."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from solvers.comparison import Comparison, Trial
from solvers.errors import InvalidProblem, SolverError
from solvers.front import solve
from solvers.problem import Problem, Solver
from solvers.registry import families
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
    where changes nothing but the seconds, and these are charged for no compilation: each
    solver first takes a step on a small problem of the family. Ctrl-C ends the race; what has
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
        Name of an instance -> best cost known; for those missing here and in the instances,
        tables measure from the best cost that any solver found.
    until_best
        Whether a run also ends once it reaches the best cost known, where one is: the seconds
        are then the time to that target, and no gap changes. Needs another limit besides.
    map
        How to spread the runs, such as ``ProcessPoolExecutor().map``; everything that travels
        pickles if the problems do.
    listener
        Called with every trial, in order.

    Raises
    ------
    InvalidProblem
        If there is nothing to compare, two instances or solvers share a name, or a run until
        the best has no other limit.

    """
    cases = tuple(_cases(problems))
    entrants = _labelled(solvers)
    seeds = tuple(seeds)
    if not (cases and entrants and seeds):
        raise InvalidProblem(
            "a comparison needs a problem, a solver and a seed, at least one each."
        )
    if until_best and not stop.limits:
        raise InvalidProblem("a run until the best cost known needs another limit besides.")
    known = {case.name: case.best_known for case in cases if case.best_known is not None}
    known.update({name: cost for name, cost in (best_known or {}).items() if name not in known})
    stops = {
        case.name: dataclasses.replace(stop, target=known[case.name])
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


_warm: set[tuple[str, str]] = set()  # families and labels that have run in this process


def _trial(job: _Job) -> Trial:
    try:
        _warm_up(job)
        result = solve(job.problem, job.solver, seed=job.seed, stop=job.stop)
    except SolverError as error:
        return Trial(job.instance, job.label, job.seed, None, str(error))
    return Trial(job.instance, job.label, job.seed, result)


def _warm_up(job: _Job) -> None:
    """Let a solver load and compile on a small problem, so that no seconds are charged for it."""
    from solvers.known_problems import larger_problem

    family = job.problem.family
    if (family, job.label) in _warm or family not in families():
        return
    _warm.add((family, job.label))
    with suppress(SolverError):  # the run itself will say it
        solve(larger_problem(family), job.solver, stop=Stop(iterations=1, seconds=1.0))


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
            if field.default is dataclasses.MISSING or value != field.default:
                words.append(f"{field.name}={value}")
    return " ".join(words)
