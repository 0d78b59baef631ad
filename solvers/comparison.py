"""What a comparison found: trials, rows and standings."""

import math
import os
import platform
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import fmean, pstdev
from typing import Any

from solvers.result import Result


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One run of one solver on one instance with one seed.

    Parameters
    ----------
    instance, solver
        Their names in the table.
    seed
        Of this run.
    result
        What came out, or ``None`` where the solver could not run.
    reason
        Why there is no result.

    """

    instance: str
    solver: str
    seed: int
    result: Result[Any] | None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Row:
    """One instance and one solver over all seeds; means are over the runs with a solution.

    Parameters
    ----------
    instance, solver
        Names.
    runs, solved
        How many runs, and how many of them found a solution.
    status
        What the runs say is known; several if they differ.
    cost, spread, least, most
        Mean, standard deviation, smallest and largest cost; not a number without any.
    bound
        Largest lower bound that a run has proven.
    gap
        Mean share of the cost that is not proven necessary.
    best_known, gap_to_best
        Best cost known (or else the best in this comparison), and mean excess over it.
    seconds, seconds_spread
        Mean and standard deviation of the wall-clock time of all runs.
    iterations
        Mean, in the solver's own iterations.
    stop_reason
        Why the runs ended; several if they differ.
    reason
        Why there is no result, or empty.

    """

    instance: str
    solver: str
    runs: int
    solved: int
    status: str
    cost: float
    spread: float
    least: float
    most: float
    bound: float
    gap: float
    best_known: float
    gap_to_best: float
    seconds: float
    seconds_spread: float
    iterations: float
    stop_reason: str
    reason: str


@dataclass(frozen=True, slots=True)
class Standing:
    """One solver over all instances; means are over the instances that it solved every time.

    Parameters
    ----------
    solver
        Name.
    solved, instances
        On how many instances every run found a solution, out of how many.
    proven
        On how many instances every run proved its cost optimal.
    gap, gap_to_best, worst_gap_to_best
        Mean of the gaps to the bounds, and mean and largest gap to the best.
    seconds
        Mean time of a run.

    """

    solver: str
    solved: int
    instances: int
    proven: int
    gap: float
    gap_to_best: float
    worst_gap_to_best: float
    seconds: float


def machine_name() -> str:
    """Processor, its cores that this process may use, system and Python, in one line."""
    name = platform.processor() or platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    except OSError:
        pass
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    plural = "" if cores == 1 else "s"
    return f"{name}, {cores} core{plural}, {platform.system()}, Python {platform.python_version()}"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Every trial of a comparison and the tables that they give.

    Parameters
    ----------
    trials
        In the order of instances, solvers and seeds.
    best_known
        Instance -> best cost known, for those that have one.
    interrupted
        Whether some trials are missing.
    machine
        Where the trials ran.

    """

    trials: tuple[Trial, ...]
    best_known: Mapping[str, float] = field(default_factory=dict)
    interrupted: bool = False
    machine: str = field(default_factory=machine_name)

    @property
    def instances(self) -> tuple[str, ...]:
        """Names of the instances, in order."""
        return tuple(dict.fromkeys(trial.instance for trial in self.trials))

    @property
    def solvers(self) -> tuple[str, ...]:
        """Labels of the solvers, in order."""
        return tuple(dict.fromkeys(trial.solver for trial in self.trials))

    def best(self, instance: str) -> float:
        """Best cost known, or else found here; infinite without any."""
        if instance in self.best_known:
            return self.best_known[instance]
        found = (t.result.cost for t in self.trials if t.instance == instance and t.result)
        return min(found, default=math.inf)

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """One row an instance and solver, in order."""
        groups: dict[tuple[str, str], list[Trial]] = {}
        for trial in self.trials:
            groups.setdefault((trial.instance, trial.solver), []).append(trial)
        return tuple(_row(group, self.best(instance)) for (instance, _), group in groups.items())

    @cached_property
    def standings(self) -> tuple[Standing, ...]:
        """One line a solver, in order."""
        return tuple(
            _standing([row for row in self.rows if row.solver == solver]) for solver in self.solvers
        )

    def markdown(self) -> str:
        """Table of the rows, table of the solvers over all instances, and the machine."""
        from solvers.tables import markdown

        return markdown(self)

    def csv(self) -> str:
        """Rows with a header; empty where there is no number."""
        from solvers.tables import comma_separated

        return comma_separated(self)

    def json(self) -> str:
        """Rows, standings and every trial with its trace; null where there is no number."""
        from solvers.tables import as_json

        return as_json(self)

    def plot(self, path: str | Path) -> None:
        """Draw the anytime curves, over seconds and over iterations; the suffix is the format."""
        from solvers.curves import draw

        draw(self, Path(path))


def excess(cost: float, best: float) -> float:
    """By what share a cost is above the best one; negative if it is below."""
    if cost == best:
        return 0.0
    return (cost - best) / abs(best) if best and math.isfinite(cost) else math.inf


def _row(trials: list[Trial], best: float) -> Row:
    results = [trial.result for trial in trials if trial.result is not None]
    solved = [result for result in results if result.solution is not None]
    costs = [result.cost for result in solved]
    seconds = [result.seconds for result in results]
    reasons = dict.fromkeys(trial.reason for trial in trials if trial.reason)
    return Row(
        instance=trials[0].instance,
        solver=trials[0].solver,
        runs=len(trials),
        solved=len(solved),
        status=" / ".join(dict.fromkeys(str(r.status) for r in results)) or "not run",
        cost=_mean(costs),
        spread=pstdev(costs) if costs else math.nan,
        least=min(costs, default=math.nan),
        most=max(costs, default=math.nan),
        bound=max((r.bound for r in results), default=-math.inf),
        gap=_mean(r.gap for r in solved),
        best_known=best,
        gap_to_best=_mean(excess(cost, best) for cost in costs),
        seconds=_mean(seconds),
        seconds_spread=pstdev(seconds) if seconds else math.nan,
        iterations=_mean(r.iterations for r in results),
        stop_reason=" / ".join(dict.fromkeys(str(r.stop_reason) for r in results)),
        reason="; ".join(reasons),
    )


def _standing(rows: list[Row]) -> Standing:
    solved = [row for row in rows if row.solved == row.runs]
    return Standing(
        solver=rows[0].solver,
        solved=len(solved),
        instances=len(rows),
        proven=sum(row.status == "optimal" for row in solved),
        gap=_mean(row.gap for row in solved),
        gap_to_best=_mean(row.gap_to_best for row in solved),
        worst_gap_to_best=max((row.gap_to_best for row in solved), default=math.nan),
        seconds=_mean(row.seconds for row in solved),
    )


def _mean(values: Iterable[float]) -> float:
    numbers = list(values)
    return fmean(numbers) if numbers else math.nan
