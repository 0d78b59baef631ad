"""Ways through free space against closed formulas, and orders that know what is in between."""

import itertools

import numpy as np
import pytest

from planner.airspace.roadmap import Roadmap
from planner.config import FlightSettings, RouteSettings
from planner.flight.fly import plan_flight
from planner.route.cost import Pace, switching_cost, switching_seconds
from planner.route.exact import TOO_COARSE
from planner.route.order import order_viewpoints
from planner.route.ways import FreeWays
from planner.scene.scene import Box

BOX = Box(np.array([0.0, 0.0, 15.0]), np.eye(3), np.array([60.0, 60.0, 30.0]))
MARGIN = 0.002
SMALL = ((-40, -40, -2), (40, 40, 60))
TINY = ((-12, -13, 0), (12, 13, 12))
WALL = ((-1, -30, 0), (1, 30, 100))
CAVE = [
    ((-10, -10, 0), (10, 10, 2)),
    ((-10, -10, 10), (10, 10, 12)),
    *(((s * 9 - 1, -10, 0), (s * 9 + 1, 10, 12)) for s in (-1, 1)),
    *(((-10, s * 9 - 1, 0), (10, s * 9 + 1, 12)) for s in (-1, 1)),
]


def assert_way_is_free(way, space):
    for a, b in itertools.pairwise(way.points):
        assert space.segment_distance(a, b) >= space.d_min


def test_the_way_around_a_wall_is_as_long_as_the_string_around_its_rounded_edges(solids):
    space = solids([WALL], bounds=((-60, -60, -60), (60, 60, 60)))
    ways = FreeWays(space, margin=MARGIN)
    start, end = np.array([-20.0, 20.0, 10.0]), np.array([20.0, 20.0, 10.0])
    assert not ways.straight(start[None], end[None])[0]
    way = ways.between(start, end)
    np.testing.assert_array_equal(way.points[[0, -1]], [start, end])
    assert_way_is_free(way, space)
    # each half: a tangent to the circle of 2.002 m around the edge at (-1, 30), then its arc
    radius, away = space.d_min + MARGIN, np.hypot(19.0, 10.0)
    tangent = np.sqrt(away**2 - radius**2)
    turned = np.arctan2(10.0, 19.0) + np.arcsin(radius / away)
    exact = 2.0 * (tangent + radius * turned) + 2.0
    assert exact <= way.length <= 1.02 * exact
    back = ways.between(end, start)
    np.testing.assert_array_equal(back.points[::-1], way.points)


@pytest.mark.parametrize("seed", range(12))
def test_every_way_among_random_boxes_is_free(solids, seed):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-30, 25, (6, 3)) * [1, 1, 0]
    boxes = [(a, a + rng.uniform(4, 15, 3)) for a in low]
    space = solids(boxes, ground=0.0, bounds=SMALL)
    places = rng.uniform(*space.bounds, (40, 3))
    places = np.round(places[space.clearance(places) >= space.d_min + 0.01], 4)
    ways = FreeWays(space, margin=MARGIN)
    for a, b in itertools.pairwise(places[:6]):
        way = ways.between(a, b)
        if way.points is not None:
            assert_way_is_free(way, space)
            assert way.length >= np.linalg.norm(b - a) - 1e-9


def test_edges_between_free_cells_keep_the_distance(solids):
    space = solids([((-3, -3, 0), (3, 3, 9))], balls=[(6, 6, 6, 1)], bounds=SMALL)
    roadmap = Roadmap(
        space.clearance_range,
        space.zone_margin,
        space.bounds,
        required=space.d_min,
        margin=MARGIN,
        cell=0.5,
    )
    cells = roadmap.cells_near(np.array([4.0, 4.0, 4.0]), 9)
    assert len(cells) > 500
    known = {tuple(cell) for cell in cells.tolist()}
    truly = space.clearance(roadmap.centres(cells))
    assert truly.min() >= space.d_min
    steps = [step for step in itertools.product((0, 1), (-1, 0, 1), (-1, 0, 1)) if step > (0, 0, 0)]
    near = cells[np.argsort(truly)][:40]
    for cell, step in itertools.product(near.tolist(), steps):
        other = tuple(c + s for c, s in zip(cell, step, strict=True))
        if other in known:
            a, b = roadmap.centres(np.array([cell, other]))
            assert space.segment_distance(a, b) >= space.d_min


@pytest.mark.parametrize("cost", ["paper", "seconds"])
@pytest.mark.parametrize("closed", [False, True])
def test_the_lazy_order_is_the_best_of_all_for_the_true_costs(solids, viewpoints_at, cost, closed):
    space = solids([((-1, -7, 0), (1, 7, 99)), ((-7, -1, 0), (7, 1, 6))], ground=0.0, bounds=TINY)
    spots = [[-4, -5, 5], [4, -5, 5], [-4, 5, 5], [4, 5, 6], [-8, 4, 7], [8, -4, 7], [5, 10, 8]]
    views = viewpoints_at(spots)
    ways = FreeWays(space, margin=MARGIN)
    settings = RouteSettings(cost=cost, closed=closed, solver="branch-and-bound")
    route = order_viewpoints(views, settings=settings, box=BOX, seed=0, ways=ways)
    assert route.blocked > 0
    assert route.rounds > 1
    assert route.way_length > route.length

    known = FreeWays(space, margin=MARGIN)
    metres = np.array(
        [[known.between(a, b).length for b in views.positions] for a in views.positions]
    )
    if cost == "paper":
        costs = switching_cost(views.positions, views.directions, metres)
    else:
        angles = views.yaw_deg, views.pitch_deg
        costs = switching_seconds(views.positions, *angles, pace=Pace(), lengths=metres)
    first = int(route.order[0])
    others = [row for row in range(7) if row != first]
    best = np.inf
    for rest in itertools.permutations(others):
        order = (first, *rest, first) if closed else (first, *rest)
        best = min(best, costs[order[:-1], order[1:]].sum())
    assert route.cost == pytest.approx(best)
    assert route.result.bound == pytest.approx(best)


def test_knowing_what_is_in_between_never_makes_the_true_way_longer(solids, viewpoints_at):
    space = solids([((-1, -8, 0), (1, 8, 99))], ground=0.0, bounds=TINY)
    rng = np.random.default_rng(0)
    spots = rng.uniform((-9, -8, 4), (9, 8, 10), (24, 3))
    views = viewpoints_at(np.round(spots[np.abs(spots[:, 0]) > 3.1], 4))
    ways = FreeWays(space, margin=MARGIN)
    routes = [
        order_viewpoints(views, settings=settings, box=BOX, seed=0, ways=ways)
        for settings in (RouteSettings(cost="paper", detours=look) for look in (False, True))
    ]
    true = [
        sum(ways.between(a, b).length for a, b in itertools.pairwise(views.positions[route.order]))
        for route in routes
    ]
    assert true[1] < true[0]
    assert routes[1].way_length == pytest.approx(true[1])


def test_what_cannot_be_reached_has_a_tour_of_its_own_and_a_finding(solids, viewpoints_at):
    space = solids(CAVE, bounds=SMALL)
    spots = [[-30, 0, 6], [0, 0, 6], [30, 0, 6], [0, 30, 6], [1, 1, 6], [0, -30, 6]]
    views = viewpoints_at(spots)
    ways = FreeWays(space, margin=MARGIN)
    route = order_viewpoints(views, settings=RouteSettings(), box=BOX, seed=0, ways=ways)
    assert sorted(route.order) == list(range(6))
    assert sorted(route.order[route.spaces == 1]) == [1, 4]
    assert route.spaces.tolist() == [0, 0, 0, 0, 1, 1]
    assert [finding.number for finding in route.findings] == [2.0]
    assert np.isfinite(route.cost)
    legs = itertools.pairwise(views.positions[route.order[route.spaces == 0]])
    inside = np.linalg.norm(views.positions[4] - views.positions[1])
    ways_length = sum(ways.between(a, b).length for a, b in legs) + inside
    assert route.way_length == pytest.approx(ways_length)
    flight = plan_flight(
        views.take(route.order), space, settings=FlightSettings(iterations=300), ways=ways
    )
    assert len(flight.kept) == 4


def test_places_too_narrow_for_the_roadmap_stay_in_the_tour(solids, viewpoints_at):
    space = solids([((-20, 2.01, 0), (20, 9, 30)), ((-20, -9, 0), (20, -2.01, 30))], bounds=SMALL)
    views = viewpoints_at([[-10, 0, 5], [10, 0, 5], [0, 20, 5]])
    ways = FreeWays(space, margin=MARGIN)
    assert ways.straight(views.positions[:1], views.positions[1:2])[0]
    way = ways.between(views.positions[1], views.positions[2])
    assert way.points is None
    assert not way.apart
    route = order_viewpoints(views, settings=RouteSettings(), box=BOX, seed=0, ways=ways)
    assert route.spaces.tolist() == [0, 0, 0]
    chord = np.linalg.norm(views.positions[2] - views.positions[[0, 1]], axis=1).min()
    assert route.way_length == pytest.approx(20.0 + TOO_COARSE * chord)
