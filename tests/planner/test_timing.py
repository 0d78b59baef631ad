"""Rows of the flown curve: times, speed, angles, and that they can be worked out again."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.flight.fly import plan_flight
from planner.flight.path import FlightPath
from planner.flight.timing import sample_path
from planner.geometry import bezier
from planner.geometry.angles import circular_difference_deg
from planner.viewpoints.viewpoints import Viewpoints


def viewpoints(positions, yaw, pitch):
    count = len(yaw)
    return Viewpoints(
        np.array(positions, dtype=float).reshape(count, 3),
        np.array(yaw, dtype=float),
        np.array(pitch, dtype=float),
        ("cover",) * count,
        np.full(count, -1),
    )


def wandering(count, seed):
    rng = np.random.default_rng(seed)
    positions = np.round(np.cumsum(rng.normal(0, 6, (count, 3)) + [3, 0, 0], axis=0) + 200, 4)
    return viewpoints(positions, rng.uniform(-179, 180, count), rng.uniform(-90, 0, count))


@pytest.fixture
def flown(solids):
    flight = plan_flight(wandering(25, 0), solids(ground=0.0))
    return flight.path, flight.viewpoints


def arc_lengths(path, rows):
    """Arc length from the start to each row, found from the row's place, not from its time."""
    before = np.concatenate([[0.0], np.cumsum(bezier.lengths(path.controls))])
    result = []
    for x, y, z, piece in rows[:, [1, 2, 3, 6]]:
        k = int(piece)
        t = np.linspace(0, 1, 20_001)
        points = bezier.evaluate(path.controls[k][None], t)
        near = int(np.linalg.norm(points - [x, y, z], axis=1).argmin())
        assert np.linalg.norm(points[near] - [x, y, z]) < 2e-3
        left = np.linalg.norm(np.diff(points[: near + 1], axis=0), axis=1).sum()
        result.append(before[k] + left)
    return np.array(result)


def test_times_are_a_uniform_grid_and_one_row_at_each_viewpoint(flown):
    path, views = flown
    rows = sample_path(path, views, speed=4.0)
    t = rows[:, 0]
    assert (np.diff(t) > 0.0).all()
    on_grid = np.abs(t - np.round(t, 1)) < 1e-9
    np.testing.assert_allclose(np.diff(t[on_grid]), 0.1, atol=1e-9)
    assert t[-1] == pytest.approx(path.length / 4.0, abs=1e-4)
    for spot in views.positions:
        assert np.abs(rows[:, 1:4] - spot).max(axis=1).min() < 1e-9
    off_grid = len(rows) - on_grid.sum()
    assert off_grid <= len(views) - 1 <= off_grid + 2


def test_speed_is_constant_along_the_arc(flown):
    path, views = flown
    rows = sample_path(path, views, speed=4.0)[::17]
    np.testing.assert_allclose(arc_lengths(path, rows), 4.0 * rows[:, 0], atol=5e-3)


def test_speed_is_constant_to_a_millionth_before_rounding(flown):
    path, _ = flown
    run = np.linspace(0.0, 1.0, 101)[None] * bezier.lengths(path.controls)[:, None]
    piece = np.repeat(np.arange(len(path)), 101)
    at = bezier.parameter_at(path.controls, piece, run.ravel()).reshape(-1, 101)
    for k, controls in enumerate(path.controls):
        length = 0.0
        for i in range(100):
            fine = np.linspace(at[k, i], at[k, i + 1], 401)
            rate = np.linalg.norm(bezier.derivative(controls[None], fine), axis=1)
            weight = np.full(401, 2.0)
            weight[1::2] = 4.0
            weight[[0, -1]] = 1.0
            length += (at[k, i + 1] - at[k, i]) / 1200 * (rate @ weight)  # Simpson
            assert length == pytest.approx(run[k, i + 1], rel=1e-6)


def test_rows_lie_on_the_curve_and_the_last_on_the_last_viewpoint(flown):
    path, views = flown
    rows = sample_path(path, views, speed=4.0)
    arc_lengths(path, rows[::29])  # asserts that each row is on its piece
    np.testing.assert_allclose(rows[0, 1:4], views.positions[0], atol=1e-9)
    np.testing.assert_allclose(rows[-1, 1:4], views.positions[-1], atol=1e-9)
    assert rows[-1, 4] == pytest.approx(views.yaw_deg[-1], abs=1e-4)
    assert rows[-1, 5] == pytest.approx(views.pitch_deg[-1], abs=1e-4)
    assert (np.diff(rows[:, 6]) >= 0).all()


def test_angles_pass_each_viewpoint_and_turn_the_short_way(flown):
    path, views = flown
    rows = sample_path(path, views, speed=4.0)
    assert rows[:, 4].min() > -180.0
    assert rows[:, 4].max() <= 180.0
    at = 0
    for k, spot in enumerate(views.positions):
        row = int(np.abs(rows[:, 1:4] - spot).max(axis=1).argmin())
        assert abs(circular_difference_deg(rows[row, 4], views.yaw_deg[k])) < 1e-3
        assert rows[row, 5] == pytest.approx(views.pitch_deg[k], abs=1e-3)
        if k:
            turns = circular_difference_deg(rows[at + 1 : row + 1, 4], rows[at:row, 4])
            short = circular_difference_deg(views.yaw_deg[k], views.yaw_deg[k - 1])
            assert turns.sum() == pytest.approx(short, abs=1e-2)
            assert np.abs(turns).sum() == pytest.approx(abs(short), abs=1e-2)
        at = row


def test_rows_can_be_worked_out_again_from_what_is_written(flown):
    path, views = flown
    rows = sample_path(path, views, speed=4.0)
    records = json.loads(json.dumps(path.to_records()))
    again = FlightPath.from_records(records, start=path.start)
    angles = np.round(views.yaw_deg, 4), np.round(views.pitch_deg, 4)
    read = viewpoints(np.round(views.positions, 4), *angles)
    table = sample_path(again, read, speed=4.0)
    np.testing.assert_array_equal(rows[:, :4], table[:, :4])
    np.testing.assert_allclose(rows, table, atol=2.1e-4)


def test_photos_from_one_place_take_the_time_of_the_turn(solids):
    spots = [[0, 0, 10], [0, 0, 10], [4, 0, 10], [4, 0, 10]]
    views = viewpoints(spots, [170, -130, -130, -130], [0, -30, -30, -30])
    flight = plan_flight(views, solids(ground=0.0))
    rows = sample_path(flight.path, flight.viewpoints, speed=4.0)
    assert rows[-1, 0] == pytest.approx(60 / 60 + 1.0 + 0.1)
    turning = rows[rows[:, 0] <= 1.0]
    assert (turning[:, 1:4] == [0, 0, 10]).all()
    middle = turning[5]
    assert (middle[0], middle[4], middle[5]) == (0.5, -160.0, -15.0)


def test_hardly_any_viewpoints(solids):
    none = viewpoints(np.zeros((0, 3)), [], [])
    flight = plan_flight(none, solids(ground=0.0))
    assert sample_path(flight.path, none, speed=4.0).shape == (0, 7)
    one = viewpoints([[1, 2, 10]], [-180.0], [-90.0])
    flight = plan_flight(one, solids(ground=0.0))
    assert sample_path(flight.path, one, speed=4.0).tolist() == [[0, 1, 2, 10, 180, -90, 0]]


@given(st.integers(2, 6), st.integers(0, 10_000), st.floats(0.5, 20.0), st.booleans())
def test_times_rise_and_end_when_the_curve_does(solids, count, seed, speed, closed):
    flight = plan_flight(wandering(count, seed), solids(ground=0.0), closed=closed)
    rows = sample_path(flight.path, flight.viewpoints, speed=speed)
    assert (np.diff(rows[:, 0]) > 0.0).all()
    assert np.diff(rows[:, 0]).max() <= 0.1 + 2e-4
    assert rows[-1, 0] == pytest.approx(flight.path.length / speed, abs=1e-4)
    np.testing.assert_allclose(rows[-1, 1:4], flight.viewpoints.positions[0 if closed else -1])
    hop = np.linalg.norm(np.diff(rows[:, 1:4], axis=0), axis=1)
    assert (hop <= speed * np.diff(rows[:, 0]) + 2e-3 + speed * 1e-4).all()


def test_wrong_speeds_and_foreign_viewpoints_are_refused(flown):
    path, views = flown
    with pytest.raises(ValueError, match="speed"):
        sample_path(path, views, speed=0.0)
    with pytest.raises(ValueError, match="too many rows"):
        sample_path(path, views, speed=1e-9)
    with pytest.raises(ValueError, match="viewpoint 24"):
        sample_path(path, views.take(np.arange(5)), speed=4.0)
