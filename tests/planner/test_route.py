"""Eqs. 9 to 11 by hand; orders of few viewpoints against every order there is."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.config import FlightSettings, RouteSettings
from planner.errors import PlannerError
from planner.geometry.angles import direction
from planner.route.cost import (
    Pace,
    rotation_cost,
    switching_cost,
    switching_seconds,
    translation_cost,
)
from planner.route.order import order_viewpoints, start_row
from planner.scene.scene import Box
from planner.viewpoints.viewpoints import Viewpoints

BOX = Box(np.array([5.0, 5.0, 5.0]), np.eye(3), np.array([10.0, 10.0, 10.0]))


def viewpoints(positions, yaw=None, pitch=None):
    count = len(positions)
    return Viewpoints(
        np.asarray(positions, dtype=float).reshape(count, 3),
        np.zeros(count) if yaw is None else yaw,
        np.zeros(count) if pitch is None else pitch,
        ("cover",) * count,
        np.full(count, -1),
    )


def scattered(count, seed):
    rng = np.random.default_rng(seed)
    return viewpoints(
        rng.uniform(0, 10, (count, 3)), rng.uniform(-179, 180, count), rng.uniform(-90, 0, count)
    )


def test_translation_cost_is_zero_for_the_nearest_pair_and_one_for_the_farthest():
    cost = translation_cost(np.array([[0, 0, 0], [1, 0, 0], [5, 0, 0]], dtype=float))
    np.testing.assert_allclose(cost, [[0, 0, 1], [0, 0, 0.75], [1, 0.75, 0]])


@pytest.mark.parametrize("count", [0, 1, 2])
def test_costs_of_hardly_any_viewpoints_are_zero(count):
    positions = np.arange(3.0 * count).reshape(count, 3)
    assert translation_cost(positions).tolist() == np.zeros((count, count)).tolist()


@pytest.mark.parametrize(("angle", "expected"), [(0, 0.0), (60, 0.25), (90, 0.5), (180, 1.0)])
def test_rotation_cost_of_known_angles(angle, expected):
    looks = 3.0 * direction(np.array([0.0, angle]), np.zeros(2))
    np.testing.assert_allclose(rotation_cost(looks), [[0, expected], [expected, 0]], atol=1e-15)


def test_switching_cost_is_the_mean_of_both():
    views = scattered(12, 0)
    cost = switching_cost(views.positions, views.directions)
    expected = (translation_cost(views.positions) + rotation_cost(views.directions)) / 2
    np.testing.assert_allclose(cost, expected)


@given(st.integers(2, 9), st.integers(0, 1000))
def test_costs_are_symmetric_shares_with_an_empty_diagonal(count, seed):
    views = scattered(count, seed)
    cost = switching_cost(views.positions, views.directions)
    np.testing.assert_array_equal(cost, cost.T)
    assert (np.diag(cost) == 0.0).all()
    assert cost.min() >= 0.0
    assert cost.max() <= 1.0


@pytest.mark.parametrize(
    ("there", "yaw", "pitch", "expected"),
    [
        ([20, 0, 0], 0, 0, 2.0 + 3.0 + 2.0 + 1.0),  # 4 m to 4 m/s at 2 m/s2, 12 m of it, 4 m to 0
        ([2, 0, 0], 0, 0, 1.0 + 1.0 + 1.0),  # never as fast as that
        ([2, 0, 0], 150, 0, 2.5 + 1.0),  # 150 degrees at 60 a second take longer
        ([0, 0, 0], -170, 0, 20 / 60 + 1.0),  # from 170 over the back to -170
        ([0, 0, 0], 170, -90, 1.5 + 1.0),  # the gimbal alone
    ],
)
def test_seconds_are_the_longer_of_flying_and_turning_plus_the_stop(there, yaw, pitch, expected):
    first = 0.0 if yaw in (0, 150) else 170.0
    cost = switching_seconds(
        np.array([[0, 0, 0], there], dtype=float),
        np.array([first, yaw], dtype=float),
        np.array([0.0, pitch]),
        pace=Pace(),
    )
    np.testing.assert_allclose(cost, [[0, expected], [expected, 0]])


def test_a_pace_follows_the_flight_settings():
    stop = FlightSettings(speed=3.0, yaw_rate_deg=40.0, settle_seconds=0.5)
    assert Pace.of(stop) == Pace(3.0, 2.0, 40.0, 60.0, 0.5)
    through = Pace.of(FlightSettings(speed=3.0, shoot="through", hold_seconds=0.2))
    np.testing.assert_allclose(through.flying(np.array([0.0, 6.0])) + through.rest, [0.4, 2.4])


@pytest.mark.parametrize("change", [{"speed": 0.0}, {"gimbal_rate_deg": -1.0}, {"rest": -1.0}])
def test_rates_that_are_not_positive_are_refused(change):
    with pytest.raises(ValueError, match="rates"):
        Pace(**change)


@pytest.mark.parametrize("cost", ["paper", "seconds"])
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_the_order_is_a_permutation_close_to_the_best_of_all(cost, closed, seed):
    views = scattered(7, seed)
    settings = RouteSettings(cost=cost, closed=closed)
    route = order_viewpoints(views, settings=settings, box=BOX, seed=seed)
    assert sorted(route.order) == list(range(7))
    first = start_row(views.positions, settings=settings, box=BOX)
    assert route.order[0] == first
    costs = (
        switching_cost(views.positions, views.directions)
        if cost == "paper"
        else switching_seconds(
            views.positions,
            views.yaw_deg,
            views.pitch_deg,
            pace=Pace(),
        )
    )

    def total(order):
        steps = sum(costs[a, b] for a, b in itertools.pairwise(order))
        return steps + (costs[order[-1], order[0]] if closed else 0.0)

    others = [place for place in range(7) if place != first]
    best = min(total((first, *rest)) for rest in itertools.permutations(others))
    assert best - 1e-9 <= route.cost <= 1.1 * best
    assert route.cost == pytest.approx(total(list(route.order)))
    assert route.cost == pytest.approx(route.result.cost)
    assert route.result.bound <= best + 1e-9


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_few_viewpoints_are_ordered_too(count, closed):
    views = viewpoints([[3.0 * k, 0, 0] for k in range(count)], yaw=np.arange(count) * 10.0)
    route = order_viewpoints(views, settings=RouteSettings(closed=closed), box=BOX, seed=0)
    assert sorted(route.order) == list(range(count))
    switches = max(0, count - 1)
    back = closed and count > 1
    assert route.length == pytest.approx(3.0 * switches * (2 if back else 1))
    assert route.yaw_total_deg == pytest.approx(10.0 * switches * (2 if back else 1))
    assert route.pitch_total_deg == 0.0


def test_the_tour_starts_at_the_lowest_corner_of_a_turned_box():
    turn = np.radians(30.0)
    axes = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    box = Box(np.zeros(3), axes, np.array([20.0, 10.0, 6.0]))
    corners = np.array(list(itertools.product([-1, 1], [-1, 1], [-1, 1]))) * box.size / 2
    views = viewpoints(corners @ axes)
    assert start_row(views.positions, settings=RouteSettings(), box=box) == 0
    wanted = RouteSettings(start=tuple(views.positions[6]))
    assert start_row(views.positions, settings=wanted, box=box) == 6


def test_angle_changes_go_the_short_way_round():
    views = viewpoints(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
        yaw=np.array([170.0, -170.0, -150.0]),
        pitch=np.array([-10.0, -40.0, -40.0]),
    )
    route = order_viewpoints(views, settings=RouteSettings(), box=BOX, seed=0)
    assert (route.yaw_change_deg, route.pitch_change_deg) == (20.0, 15.0)
    assert (route.yaw_total_deg, route.pitch_total_deg) == (40.0, 30.0)


class Loose:
    """A solver that cannot begin where it is told to."""

    name = "loose"
    cannot = frozenset({"start"})

    def run(self, problem, run):
        raise NotImplementedError


class Broken(Loose):
    """A solver that fails."""

    cannot = frozenset()


@pytest.mark.parametrize("solver", ["Loose", "Broken"])
def test_a_solver_that_cannot_order_photos_is_named_with_its_setting(solver):
    settings = RouteSettings(solver=f"{__name__}:{solver}")
    with pytest.raises(PlannerError, match=r"route\.solver = .*choose another") as refused:
        order_viewpoints(scattered(9, 0), settings=settings, box=BOX, seed=0)
    assert str(refused.value).count("choose another") == 1
    assert not str(refused.value).endswith(".")
