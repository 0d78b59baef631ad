"""Sorties as vehicle routes, which may take the photos in another order."""

from typing import Any

import numpy as np

from planner.geometry.arrays import Ints
from planner.sorties.problem import SortieProblem, Split

TICKS = 1000
"""Times become whole ticks, so many a second, rounded up: no limit is broken by rounding."""

_ENDLESS = 10**8  # seconds: the library needs some limit


def route_sorties(
    problem: SortieProblem, start: Split | None = None, *, solutions: int | None = None
) -> Split | None:
    """Search sorties with the routing library of OR-Tools: a vehicle is a sortie.

    Parameters
    ----------
    problem
        Times and limits.
    start
        Sorties to begin with; without any the library builds its own.
    solutions
        How many solutions to look at; the same number gives the same answer. By default a few
        for each photo.

    Returns
    -------
    split
        The best found, in the order of the first photo of each sortie in ``start``; ``None`` if
        the library found none.

    """
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    homes, count = len(problem.out), problem.size
    fleet = _fleet(problem, start)
    depots = [count + home for home in range(homes) for _ in range(fleet)]
    manager = pywrapcp.RoutingIndexManager(count + homes, len(depots), depots, depots)
    model = pywrapcp.RoutingModel(manager)
    seconds, waypoints = _matrices(problem)
    transit = model.RegisterTransitMatrix(seconds.tolist())
    model.SetArcCostEvaluatorOfAllVehicles(transit)
    model.SetFixedCostOfAllVehicles(int(np.ceil(problem.turnaround * TICKS)))
    most_seconds = int(np.floor(problem.endurance * TICKS))
    model.AddDimension(transit, 0, most_seconds, True, "seconds")
    if problem.most is not None:
        counted = model.RegisterTransitMatrix(waypoints.tolist())
        model.AddDimension(counted, 0, problem.most, True, "waypoints")
    parameters = pywrapcp.DefaultRoutingSearchParameters()
    strategies = routing_enums_pb2.FirstSolutionStrategy
    parameters.first_solution_strategy = strategies.PARALLEL_CHEAPEST_INSERTION
    parameters.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    parameters.time_limit.FromSeconds(_ENDLESS)
    parameters.solution_limit = 2 * count + 50 if solutions is None else solutions
    model.CloseModelWithParameters(parameters)
    hint = None if start is None else _hint(model, manager, start, fleet, homes)
    if hint is None:
        found = model.SolveWithParameters(parameters)
    else:
        found = model.SolveFromAssignmentWithParameters(hint, parameters)
    if found is None:
        return None
    return _split(problem, _routes(model, manager, found), start)


def _fleet(problem: SortieProblem, start: Split | None) -> int:
    """Vehicles at each station: more than one answer has, where there is one."""
    return problem.size if start is None else min(problem.size, len(start.sorties) + 2)


def _matrices(problem: SortieProblem) -> tuple[Ints, Ints]:
    """Ticks and waypoints from place to place; the stations come after the photos."""
    count, homes = problem.size, len(problem.out)
    seconds = np.zeros((count + homes, count + homes))
    seconds[:count, :count] = problem.legs
    seconds[count:, :count] = problem.out
    seconds[:count, count:] = problem.back.T
    np.fill_diagonal(seconds, 0.0)
    ticks = np.minimum(np.ceil(seconds * TICKS - 1e-6), 2.0**40).astype(np.int64)
    waypoints = np.zeros_like(ticks)
    waypoints[:count, :count] = problem.points
    waypoints[count:, :count] = 1 + problem.out_points
    waypoints[:count, count:] = problem.back_points.T
    return ticks, waypoints


def _hint(model: Any, manager: Any, start: Split, fleet: int, homes: int) -> Any:
    """Give sorties as an assignment to begin with; ``None`` if the library refuses it."""
    routes: list[list[int]] = [[] for _ in range(fleet * homes)]
    used = [0] * homes
    for photos, home in zip(start.sorties, start.stations, strict=True):
        if used[home] == fleet:
            return None
        routes[home * fleet + used[home]] = [manager.NodeToIndex(int(photo)) for photo in photos]
        used[home] += 1
    return model.ReadAssignmentFromRoutes(routes, True)


def _routes(model: Any, manager: Any, found: Any) -> list[list[int]]:
    """Photos of each vehicle."""
    routes = []
    for vehicle in range(model.vehicles()):
        index, photos = found.Value(model.NextVar(model.Start(vehicle))), []
        while not model.IsEnd(index):
            photos.append(manager.IndexToNode(index))
            index = found.Value(model.NextVar(index))
        routes.append(photos)
    return routes


def _split(problem: SortieProblem, routes: list[list[int]], start: Split | None) -> Split:
    """Sorties that are the routes, in about the order of the sorties to begin with."""
    place = np.arange(problem.size)
    if start is not None:
        place[start.order] = np.arange(problem.size)
    fleet = len(routes) // len(problem.out)
    used = [
        (vehicle // fleet, np.array(photos, dtype=np.int64))
        for vehicle, photos in enumerate(routes)
        if photos
    ]
    used.sort(key=lambda route: float(place[route[1]].mean()))
    cost = sum(problem.seconds(home, photos) + problem.turnaround for home, photos in used)
    stations = tuple(home for home, _ in used)
    return Split(tuple(photos for _, photos in used), stations, cost, "routing")
