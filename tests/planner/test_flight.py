"""Whole flights among solids with exact distances."""

import numpy as np
import pytest

from planner.config import FlightSettings
from planner.flight.fly import plan_flight
from planner.flight.path import FlightPath, end_tangents

QUICK = FlightSettings(iterations=500)


def assert_joined(flight):
    """The curve passes each kept viewpoint, in order, without a gap."""
    path, spots = flight.path, flight.viewpoints.positions
    at = path.start
    for piece in range(len(path)):
        if piece == 0 or path.reached[piece - 1] >= 0:
            np.testing.assert_allclose(path.controls[piece, 0], spots[at], atol=1e-9)
        if path.reached[piece] >= 0:
            at = path.reached[piece]
            np.testing.assert_allclose(path.controls[piece, 3], spots[at], atol=1e-9)
    legs = len(spots) if flight.closed else len(spots) - 1
    wanted = [*range(1, len(spots)), *([0] if flight.closed else [])]
    assert path.reached[path.reached >= 0].tolist() == wanted[: max(legs, 0)]


def assert_smooth(flight, angle=1e-3):
    ends = end_tangents(flight.path.controls)
    turn = np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1)
    assert turn.max(initial=0.0) < angle


def tower(solids, **options):
    return solids([((-5, -5, 0), (5, 5, 30))], ground=0.0, **options)


def open_field(seed, count):
    rng = np.random.default_rng(seed)
    return np.round(rng.uniform((-40, -40, 20), (40, 40, 30), (count, 3)), 4)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 30])
def test_free_flight_is_smooth_joined_and_safe(solids, count, closed, assert_safe, viewpoints_at):
    views = viewpoints_at(open_field(count, count))
    flight = plan_flight(views, solids(ground=0.0), closed=closed)
    assert_safe(flight, solids(ground=0.0))
    assert_joined(flight)
    assert_smooth(flight)
    assert flight.kept.tolist() == list(range(count))
    assert not flight.findings
    assert len(flight.path) == max(0, count - 1 + (closed and count > 1))
    assert flight.path.start == (0 if count else -1)
    np.testing.assert_array_equal(flight.viewpoints.yaw_deg, views.yaw_deg)


def test_a_tower_in_the_way_is_flown_around(solids, assert_safe, viewpoints_at):
    space = tower(solids)
    views = viewpoints_at([[-20, 0, 10], [20, 0, 10], [20, 15, 10], [-20, 15, 10]])
    flight = plan_flight(views, space)
    assert_safe(flight, space)
    assert_joined(flight)
    assert_smooth(flight)
    assert flight.repaired.tolist() == [0]
    assert flight.path.repaired.tolist() == (flight.path.leg == 0).tolist()
    assert flight.path.length < 1.15 * (2 * np.hypot(20, 7) + 15 + 40)
    assert len(flight.results) == 1


def test_a_tour_around_a_tower_comes_back(solids, assert_safe, viewpoints_at):
    space = tower(solids)
    corners = [[-9, -9, 9], [9, 9, 9], [9, -9, 9], [-9, 9, 9]]
    flight = plan_flight(viewpoints_at(corners), space, closed=True)
    assert_safe(flight, space)
    assert_joined(flight)
    np.testing.assert_array_equal(flight.path.controls[0, 0], flight.path.controls[-1, 3])


def test_an_arc_that_would_swing_into_a_wall_is_drawn_in(solids, assert_safe, viewpoints_at):
    space = solids([((2.1, -40, -40), (4, 40, 40))], d_min=2.0)  # 0.1 m of slack at x = 0
    views = viewpoints_at([[-20, -10, 5], [0, 0, 5], [0, 10, 5], [-20, 20, 5]])
    flight = plan_flight(views, space)
    assert_safe(flight, space)
    assert_joined(flight)
    assert not flight.repaired.size


def cave(solids, centre=(0.0, 0.0, 20.0), inner=4.0, wall=1.0, **options):
    """A closed box with room inside."""
    low, high = np.array(centre) - inner, np.array(centre) + inner
    walls = []
    for axis in range(3):
        for side in (0, 1):
            a, b = low - wall, high + wall
            a[axis], b[axis] = (a[axis], low[axis]) if side == 0 else (high[axis], b[axis])
            walls.append((a, b))
    return solids(walls, ground=0.0, d_min=1.0, **options)


@pytest.mark.parametrize("place", [0, 2, 4])
def test_a_viewpoint_in_a_closed_cave_is_dropped_wherever_it_comes(
    solids, place, assert_safe, viewpoints_at
):
    space = cave(solids)
    spots = [[-20, -20, 20], [-20, 20, 20], [20, 20, 20], [20, -20, 20]]
    spots.insert(place, [0, 0, 20])
    flight = plan_flight(viewpoints_at(spots), space, settings=QUICK)
    assert_safe(flight, space)
    assert_joined(flight)
    assert flight.kept.tolist() == [k for k in range(5) if k != place]
    assert [f.code for f in flight.findings] == ["viewpoint-dropped"]
    assert flight.findings[0].number == place
    assert "no safe way" in flight.findings[0].message


def test_the_larger_group_is_kept(solids, assert_safe, viewpoints_at):
    space = cave(solids)
    inside = [[0, 0, 20], [1, 0, 20], [0, 1, 21], [1, 1, 19]]
    views = viewpoints_at([inside[0], [-20, 0, 20], inside[1], inside[2], [20, 0, 20], inside[3]])
    flight = plan_flight(views, space, settings=QUICK)
    assert flight.kept.tolist() == [0, 2, 3, 5]
    assert_safe(flight, space)
    assert_joined(flight)


def test_a_viewpoint_that_is_not_free_is_dropped_first(solids, assert_safe, viewpoints_at):
    space = tower(solids, ceiling=25.0)
    spots = [[-20, 0, 10], [0, 0, 10], [20, 0, 10], [6.9, 0, 10], [20, 20, 26]]
    flight = plan_flight(viewpoints_at(spots), space)
    assert flight.kept.tolist() == [0, 2]
    assert [f.number for f in flight.findings] == [1.0, 3.0, 4.0]
    assert "from solids" in flight.findings[1].message
    assert "ceiling" in flight.findings[2].message
    assert_safe(flight, space)


def test_no_curve_leaves_the_space_that_is_known(solids, assert_safe, viewpoints_at):
    space = solids(ground=0.0, bounds=((-20, -20, 0), (20, 20, 30)))
    spots = [[-19, -15, 10], [19, -14, 10], [19.9, 0, 10], [19, 14, 10], [-19, 15, 10], [0, 21, 9]]
    flight = plan_flight(viewpoints_at(spots), space, closed=True)
    assert_safe(flight, space)
    assert flight.kept.tolist() == [0, 1, 2, 3, 4]
    assert "1.000 m beyond" in flight.findings[0].message


def test_nothing_free_gives_an_empty_flight(solids, viewpoints_at):
    flight = plan_flight(viewpoints_at([[0, 0, 10], [1, 0, 12]]), tower(solids))
    assert len(flight.path) == 0
    assert flight.path.start == -1
    assert len(flight.findings) == 2


def test_viewpoints_at_one_place_are_all_kept(solids, assert_safe, viewpoints_at):
    spots = [[0, 0, 10], [0, 0, 10], [5, 0, 10], [5, 0, 10], [5, 0, 10], [5, 5, 10]]
    flight = plan_flight(viewpoints_at(spots), solids(ground=0.0))
    assert flight.kept.tolist() == list(range(6))
    assert_joined(flight)
    assert_safe(flight, solids(ground=0.0))


def test_viewpoints_at_one_place_just_at_the_margin_are_all_kept(
    solids, assert_safe, viewpoints_at
):
    space = solids(ground=0.0, d_min=2.0)
    place = [1.0, 1.0, 2.002]
    assert space.clearance(np.array([place]))[0] - 2.0 - 0.002 < 0.0  # by rounding alone
    for spots in ([place] * 3, [place, place, [9.0, 1.0, 4.0]]):
        flight = plan_flight(viewpoints_at(spots), space)
        assert len(flight.kept) == len(spots)
        assert np.isfinite(flight.path.controls).all()


def test_straight_back_is_flown_too(solids, assert_safe, viewpoints_at):
    flight = plan_flight(viewpoints_at([[0, 0, 10], [10, 0, 10], [0, 0, 10]]), solids(ground=0.0))
    assert_safe(flight, solids(ground=0.0))
    assert_joined(flight)
    assert_smooth(flight)


def test_the_same_seed_gives_the_same_bits_and_legs_ignore_their_company(solids, viewpoints_at):
    space = tower(solids)
    spots = [[-20, 0, 10], [20, 0, 10], [20, 15, 10], [0, 18, 10], [0, -18, 12]]
    first, second = (plan_flight(viewpoints_at(spots), space, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.path.controls, second.path.controls)
    alone = plan_flight(viewpoints_at(spots[3:]), space, seed=3)
    np.testing.assert_array_equal(alone.results[-1].solution, first.results[-1].solution)
    other = plan_flight(viewpoints_at(spots), space, seed=4)
    assert first.results[0].seed != other.results[0].seed


def test_a_path_survives_its_records(solids, viewpoints_at):
    space = tower(solids)
    path = plan_flight(viewpoints_at([[-20, 0, 10], [20, 0, 10], [20, 9, 10]]), space).path
    again = FlightPath.from_records(path.to_records(), start=path.start)
    for name in ("controls", "leg", "reached", "repaired", "clearance", "zone_margin"):
        np.testing.assert_array_equal(getattr(path, name), getattr(again, name))
    assert "inf" not in str(path.to_records())


def test_torn_or_misnumbered_paths_are_refused(solids, viewpoints_at):
    path = plan_flight(viewpoints_at(open_field(0, 4)), solids(ground=0.0)).path
    records = path.to_records()
    for key, value in (("leg", 5), ("reached", -1), ("controls", np.ones((4, 3)).tolist())):
        broken = [dict(record) for record in records]
        broken[1][key] = value
        with pytest.raises(ValueError, match=r"leg|viewpoint|piece"):
            FlightPath.from_records(broken, start=0)
    with pytest.raises(ValueError, match="count from 0"):
        FlightPath.from_records(records, start=-1)
    with pytest.raises(ValueError, match="malformed"):
        FlightPath.from_records([{"leg": 0}], start=0)
