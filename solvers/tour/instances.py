"""Problems and tours from TSPLIB files, and back; problems from dice."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solvers.arrays import Floats, read_only
from solvers.errors import InvalidProblem
from solvers.tour.distances import METRICS, filled, metric_costs
from solvers.tour.problem import Order, TourProblem
from solvers.tour.tsplib_file import Lines, Parts


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """A problem with its name and, where the file gives them, the places on a map.

    Parameters
    ----------
    name
        What tables call it.
    problem
        The closed tour problem.
    places
        Coordinates, shape (n, 2) or (n, 3), in the units of the file; latitude and
        longitude as degrees and minutes (``DDD.MM``) where the metric is ``GEO``.
    comment
        What the file says about itself.

    """

    name: str
    problem: TourProblem
    places: Floats | None = None
    comment: str = ""


def read_tsplib(path: str | Path) -> Instance:
    """Read a symmetric or asymmetric problem (``.tsp``, ``.atsp``).

    Raises
    ------
    InvalidProblem
        If the file cannot be read or is broken (the message names the file and the line), or
        holds another kind of problem.

    """
    parts = Parts(Lines(Path(path)))
    if parts.get("TYPE", "TSP") not in {"TSP", "ATSP"}:
        raise parts.wrong("TYPE", f"TYPE {parts.get('TYPE')} is neither TSP nor ATSP")
    size = parts.size()
    kind = parts.need("EDGE_WEIGHT_TYPE")
    if kind == "EXPLICIT":
        places = parts.places.get("DISPLAY_DATA_SECTION", parts.places.get("NODE_COORD_SECTION"))
        costs = _matrix(parts, size)
    elif kind in METRICS:
        places = parts.places.get("NODE_COORD_SECTION")
        if places is None:
            raise parts.lines.wrong("the file has no NODE_COORD_SECTION")
        if places.shape[1] < METRICS[kind]:
            raise parts.wrong("EDGE_WEIGHT_TYPE", f"{kind} needs {METRICS[kind]} coordinates")
        costs = metric_costs(kind, places[:, : METRICS[kind]])
    else:
        known = ", ".join(("EXPLICIT", *METRICS))
        raise parts.wrong("EDGE_WEIGHT_TYPE", f"EDGE_WEIGHT_TYPE {kind} is none of {known}")
    try:
        problem = TourProblem(costs)
    except InvalidProblem as error:
        raise InvalidProblem(f"{path}: {error}") from error
    if places is not None:
        read_only(places)
    name = parts.get("NAME").removesuffix(".tsp").removesuffix(".atsp") or Path(path).stem
    return Instance(name, problem, places, parts.get("COMMENT", ""))


def random_instance(n: int, seed: int, *, clusters: int = 0, closed: bool = True) -> Instance:
    """Places in a square of side 1000, evenly spread or around cluster centres.

    Parameters
    ----------
    n
        How many places, at least 1.
    seed
        The same seed gives the same places.
    clusters
        How many centres the places crowd around, each with a standard deviation of 30; 0 for
        an even spread.
    closed
        Whether the tour is a round trip.

    """
    rng = np.random.default_rng(seed)
    places = 1000.0 * rng.random((n, 2))
    if clusters:
        centres = 1000.0 * rng.random((clusters, 2))
        places = centres[rng.integers(0, clusters, n)] + 30.0 * rng.standard_normal((n, 2))
    costs = np.linalg.norm(places[:, None] - places[None, :], axis=2)
    read_only(places)
    kind = f"clustered-{n}-{clusters}" if clusters else f"random-{n}"
    return Instance(f"{kind}-{seed}", TourProblem(costs, closed), places)


def read_tour(path: str | Path) -> Order:
    """Read the order of a tour file (``.tour``), numbered from 0, shape (n,).

    Raises
    ------
    InvalidProblem
        If the file cannot be read or is broken; the message names the file and the line.

    """
    parts = Parts(Lines(Path(path)))
    if parts.get("TYPE", "TOUR") != "TOUR":
        raise parts.wrong("TYPE", f"TYPE {parts.get('TYPE')} is not TOUR")
    if parts.order is None:
        raise parts.lines.wrong("the file has no TOUR_SECTION")
    return parts.order


def write_tour(path: str | Path, order: Order, *, name: str, comment: str = "") -> None:
    """Write an order of places as a tour file, numbered from 1 as the format wants."""
    head = [f"NAME : {name}", f"COMMENT : {comment}", "TYPE : TOUR", f"DIMENSION : {len(order)}"]
    body = [str(int(place) + 1) for place in order]
    lines = [*(line for line in head if comment or "COMMENT" not in line), "TOUR_SECTION", *body]
    Path(path).write_text("\n".join([*lines, "-1", "EOF", ""]), encoding="utf-8")


def write_tsplib(path: str | Path, problem: TourProblem, *, name: str, comment: str = "") -> None:
    """Write the costs of a problem as a full matrix, with all their digits.

    Raises
    ------
    InvalidProblem
        If the tour is open or its start is fixed, which the format cannot say.

    """
    if not problem.closed or problem.start is not None:
        raise InvalidProblem("TSPLIB knows closed tours without a fixed start only.")
    head = [
        f"NAME : {name}",
        *([f"COMMENT : {comment}"] if comment else []),
        f"TYPE : {'TSP' if problem.symmetric else 'ATSP'}",
        f"DIMENSION : {problem.size}",
        "EDGE_WEIGHT_TYPE : EXPLICIT",
        "EDGE_WEIGHT_FORMAT : FULL_MATRIX",
        "EDGE_WEIGHT_SECTION",
    ]
    body = [" ".join(f"{cost:.17g}" for cost in row) for row in problem.costs.tolist()]
    Path(path).write_text("\n".join([*head, *body, "EOF", ""]), encoding="utf-8")


def _matrix(parts: Parts, size: int) -> Floats:
    """Costs from the numbers that the file lists."""
    if parts.numbers is None:
        raise parts.lines.wrong("the file has no EDGE_WEIGHT_SECTION")
    costs = filled(parts.get("EDGE_WEIGHT_FORMAT", "FULL_MATRIX"), size, parts.numbers)
    if parts.get("TYPE", "TSP") == "TSP":
        np.fill_diagonal(costs, 0.0)
        if not np.array_equal(costs, costs.T):
            raise parts.wrong("EDGE_WEIGHT_FORMAT", "the matrix is not symmetric; its TYPE is ATSP")
    return costs
