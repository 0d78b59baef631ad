"""Find a solver by name without importing any of the others."""

import difflib
import inspect
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from solvers.errors import InvalidProblem, SolverError, SolverFailed, SolverUnavailable

BUILT_IN: dict[str, dict[str, str]] = {
    "cover": {
        "greedy": "solvers.cover.greedy:Greedy",
        "cvxpy": "solvers.cover.cvxpy_ilp:CvxpyILP",
        "cp-sat": "solvers.cover.cp_sat:CpSat",
        "local-search": "solvers.cover.local_search:LocalSearch",
        "lagrangian": "solvers.cover.lagrangian:Lagrangian",
    },
    "pairs": {
        "greedy": "solvers.pairs.greedy:Greedy",
        "lns": "solvers.pairs.lns:LargeNeighbourhood",
    },
    "tour": {
        "auto": "solvers.tour.auto:Auto",
        "nearest": "solvers.tour.nearest:Nearest",
        "two-opt": "solvers.tour.two_opt:TwoOpt",
        "iterated-local-search": "solvers.tour.iterated:IteratedLocalSearch",
        "branch-and-bound": "solvers.tour.branch_and_bound:BranchAndBound",
        "ant-colony": "solvers.tour.ant_colony:AntColony",
        "particle-swarm": "solvers.tour.particle_swarm:ParticleSwarm",
        "ortools": "solvers.tour.ortools_routing:OrtoolsRouting",
        "christofides": "solvers.tour.christofides:Christofides",
        "fast-tsp": "solvers.tour.fast_tsp:FastTSP",
    },
    "motion": {
        "rrt-connect": "solvers.motion.ompl_planners:RRTConnect",
        "rrt-star": "solvers.motion.ompl_anytime:RRTstar",
        "informed-rrt-star": "solvers.motion.ompl_anytime:InformedRRTstar",
        "sorrt-star": "solvers.motion.ompl_anytime:SORRTstar",
        "bit-star": "solvers.motion.ompl_anytime:BITstar",
        "aorrtc": "solvers.motion.ompl_anytime:AORRTC",
        "fmt": "solvers.motion.ompl_anytime:FMT",
        "bfmt": "solvers.motion.ompl_anytime:BFMT",
        "prm": "solvers.motion.ompl_anytime:PRM",
        "prm-star": "solvers.motion.ompl_anytime:PRMstar",
        "rrt": "solvers.motion.ompl_planners:RRT",
        "kpiece": "solvers.motion.ompl_planners:KPIECE",
        "bkpiece": "solvers.motion.ompl_planners:BKPIECE",
        "lbkpiece": "solvers.motion.ompl_planners:LBKPIECE",
    },
}
"""Family -> name -> ``"module:Class"``. Third parties use entry points instead."""

_INSTALLED_AS = {"fcl": "python-fcl", "fast_tsp": "fast-tsp"}
"""Distributions whose name differs from what they are imported as."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One registered solver: where it comes from and whether it can run here."""

    family: str
    name: str
    spec: str
    built_in: bool


def families() -> tuple[str, ...]:
    """Names of the problem families."""
    return tuple(BUILT_IN)


def entries(family: str) -> tuple[Entry, ...]:
    """Every registered solver of a family: the built-in ones, then plug-ins by name."""
    own = [Entry(family, name, spec, True) for name, spec in _built_in(family).items()]
    taken = {entry.name for entry in own}
    found = {name: spec for name, spec in sorted(_plugged_in(family)) if name not in taken}
    return (*own, *(Entry(family, name, spec, False) for name, spec in found.items()))


def names(family: str) -> tuple[str, ...]:
    """Names of every registered solver of a family, installed plug-ins included."""
    return tuple(entry.name for entry in entries(family))


def catalogue() -> list[dict[str, Any]]:
    """One plain row for each registered solver of every family, ready for a table or JSON.

    Keys: ``family``, ``name``, ``source`` ("built in", or a plug-in's ``"module:Class"``),
    ``available``, ``missing`` (what to install, or why a plug-in does not load; empty if
    available) and ``summary`` (first line of its description).
    """
    rows: list[dict[str, Any]] = []
    for entry in (entry for family in families() for entry in entries(family)):
        summary = ""
        try:
            solver = load(entry.family, entry.name)
            absent, summary = ", ".join(missing(solver)), _summary(solver)
        except SolverError as error:
            absent = str(error)
        source = "built in" if entry.built_in else entry.spec
        row = {"family": entry.family, "name": entry.name, "source": source}
        rows.append({**row, "available": not absent, "missing": absent, "summary": summary})
    return rows


def load(family: str, solver: Any, /, **parameters: Any) -> Any:
    """Solver by name, by ``"module:Class"``, or the object itself.

    Parameters
    ----------
    family
        ``"cover"``, ``"pairs"``, ``"tour"`` or ``"motion"``.
    solver
        Built-in name, entry point, ``"module:Class"``, class or solver.
    parameters
        Fields of the solver's class; its defaults where left out.

    Raises
    ------
    InvalidProblem
        If nothing has that name (the message lists what there is), if the object is no
        solver, or if a parameter is unknown.

    """
    found = _resolve(_spec(family, solver), solver) if isinstance(solver, str) else solver
    if inspect.isclass(found):
        try:
            found = found(**parameters)
        except (TypeError, ValueError) as error:
            raise InvalidProblem(f"solver {solver!r} refuses its parameters: {error}") from error
    elif parameters:
        raise InvalidProblem(f"solver {solver!r} is an object: set its parameters when making it.")
    if not isinstance(getattr(found, "name", None), str) or not callable(
        getattr(found, "run", None)
    ):
        raise InvalidProblem(f"{solver!r} is no solver: it needs a `name` and a `run` method.")
    return found


def missing(solver: Any) -> tuple[str, ...]:
    """Packages that a solver (or its class) needs and that are not installed here."""
    needed: tuple[str, ...] = getattr(solver, "requires", ())
    return tuple(_INSTALLED_AS.get(name, name) for name in needed if not _installed(name))


def require(solver: Any) -> None:
    """Raise :class:`SolverUnavailable`, naming what to install, if a package is missing."""
    absent = missing(solver)
    if absent:
        raise SolverUnavailable(
            f"solver {solver.name!r} needs {' and '.join(absent)}: pip install {' '.join(absent)}"
        )


def _summary(solver: Any) -> str:
    described = inspect.getdoc(type(solver)) or ""
    made_up = described.startswith(f"{type(solver).__name__}(")  # what `dataclass` puts there
    return "" if made_up else described.partition("\n")[0]


def _built_in(family: str) -> dict[str, str]:
    if family not in BUILT_IN:
        raise InvalidProblem(f"no problem family {family!r}; there are {', '.join(BUILT_IN)}.")
    return BUILT_IN[family]


def _plugged_in(family: str) -> list[tuple[str, str]]:
    from importlib.metadata import entry_points

    return [(point.name, point.value) for point in entry_points(group=f"solvers.{family}")]


def _spec(family: str, name: str) -> str:
    if name in _built_in(family):  # not worth a look through everything installed
        return _built_in(family)[name]
    known = {entry.name: entry.spec for entry in entries(family)}
    if name in known:
        return known[name]
    if ":" in name:
        return name
    close = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    raise InvalidProblem(
        f"no {family} solver {name!r}; there are {', '.join(known) or 'none'}.{hint}"
    )


def _resolve(spec: str, name: str) -> Any:
    module_name, _, attribute = spec.partition(":")
    try:
        found: Any = import_module(module_name.strip())
        for part in attribute.strip().split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError, ValueError) as error:
        raise InvalidProblem(f"solver {name!r} cannot be loaded from {spec!r}: {error}") from error
    except Exception as error:  # a plug-in may raise anything when imported
        raise SolverFailed(f"importing solver {name!r} from {spec!r} failed: {error}") from error
    return found


def _installed(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except (ImportError, ValueError):
        return False
