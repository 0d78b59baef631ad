"""Trapezoids, triangles and bends that can be worked out by hand, and limits that always hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.flight.profile import CREEP, curvature_bound, speed_in_bends, speed_profile
from planner.geometry import bezier


def profile(lengths, fastest, ends, acceleration=2.0):
    arrays = (np.array(values, dtype=float) for values in (lengths, fastest, ends))
    return speed_profile(*arrays, acceleration=acceleration)


def test_a_long_way_from_rest_to_rest_is_a_trapezoid():
    # 4 m/s at 2 m/s2: 2 s and 4 m to speed up, as much to brake, 12 m of cruising in 3 s
    found = profile([20.0], [4.0], [0.0, 0.0])
    assert [float(phase[0]) for phase in found.phases] == pytest.approx([2.0, 3.0, 2.0])
    run, speed = found.at(np.zeros(4, dtype=int), np.array([1.0, 2.0, 5.0, 6.0]))
    np.testing.assert_allclose(run, [1.0, 4.0, 16.0, 19.0])
    np.testing.assert_allclose(speed, [2.0, 4.0, 4.0, 2.0])


def test_a_short_way_is_a_triangle():
    # 2 m from rest to rest: half of it speeding up, 1 = t^2, peak 2 m/s
    found = profile([2.0], [4.0], [0.0, 0.0])
    assert found.peak[0] == pytest.approx(2.0)
    assert [float(phase[0]) for phase in found.phases] == pytest.approx([1.0, 0.0, 1.0])


def test_cutting_a_way_into_intervals_changes_nothing():
    whole = profile([20.0], [4.0], [0.0, 0.0])
    cut = profile(np.full(37, 20.0 / 37), np.full(37, 4.0), [0.0, *[np.inf] * 36, 0.0])
    assert cut.duration.sum() == pytest.approx(whole.duration.sum())
    short = profile(np.full(8, 0.25), np.full(8, 4.0), [0.0, *[np.inf] * 7, 0.0])
    assert short.duration.sum() == pytest.approx(2.0)


def test_a_slow_bend_is_braked_for_and_left_as_soon_as_it_ends():
    # 4 m/s, a bend of 3 m at 1 m/s: braking from 4 to 1 takes (16 - 1) / 4 m and 1.5 s
    found = profile([10.0, 3.0, 10.0], [4.0, 1.0, 4.0], [4.0, np.inf, np.inf, 4.0])
    np.testing.assert_allclose(found.speed, [4.0, 1.0, 1.0, 4.0])
    assert found.phases[2][0] == pytest.approx(1.5)
    assert found.duration[0] == pytest.approx(1.5 + (10.0 - 3.75) / 4.0)
    assert found.duration[1] == pytest.approx(3.0)
    assert found.duration[2] == pytest.approx(found.duration[0])


def test_a_circle_of_known_radius_is_flown_at_the_speed_of_its_curvature():
    # a quarter of a circle of 8 m: v^2 = 2 * 8, the cubic is within a fraction of a percent
    k = 8.0 * 4.0 / 3.0 * (np.sqrt(2.0) - 1.0)
    quarter = np.array([[[8, 0, 5], [8, k, 5], [k, 8, 5], [0, 8, 5]]], dtype=float)
    np.testing.assert_allclose(speed_in_bends(quarter, 2.0), 4.0, rtol=0.02)
    tilted = quarter @ np.array([[1, 0, 0], [0, 0.6, 0.8], [0, -0.8, 0.6]])
    np.testing.assert_allclose(speed_in_bends(tilted, 2.0), speed_in_bends(quarter, 2.0))


def test_straight_and_resting_pieces_have_no_bend_and_a_hairpin_is_crept_through():
    straight = bezier.straight(np.zeros((1, 3)), np.array([[3.0, 4.0, 1.0]]))
    assert np.isinf(speed_in_bends(np.round(straight, 6), 2.0)).all()
    assert np.isinf(speed_in_bends(np.zeros((1, 4, 3)), 2.0)).all()
    hairpin = np.array([[[0, 0, 0], [9, 0.001, 0], [9, 0.001, 0], [0, 0.002, 0]]], dtype=float)
    assert speed_in_bends(hairpin, 2.0).min() == CREEP


def curvature(controls, t):
    """Curvature by the power basis, shape (M, len(t))."""
    a, b, c, d = controls.transpose(1, 0, 2)[:, :, None]
    t = t[None, :, None]
    first = 3 * (b - a) + 6 * t * (c - 2 * b + a) + 3 * t**2 * (d - 3 * c + 3 * b - a)
    second = 6 * (c - 2 * b + a) + 6 * t * (d - 3 * c + 3 * b - a)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.linalg.norm(np.cross(first, second), axis=2) / np.linalg.norm(first, axis=2) ** 3


@given(st.integers(0, 10_000), st.integers(1, 40), st.sampled_from([0.0, 1e-3, 0.3, 3.0]))
def test_no_point_of_a_piece_bends_more_than_its_bound(seed, parts, spread):
    rng = np.random.default_rng(seed)
    controls = rng.normal(0, 5, (20, 2, 3)).repeat(2, axis=1) + rng.normal(0, spread, (20, 4, 3))
    bound = curvature_bound(controls, parts)
    t = np.linspace(0, 1, 40 * parts, endpoint=False) + 0.5 / (40 * parts)
    found = np.nan_to_num(curvature(controls, t), nan=0.0).reshape(20, parts, 40)
    assert (found.max(axis=2) <= bound * (1 + 1e-6) + 1e-6).all()


def test_the_bound_is_hardly_more_than_the_truth_where_pieces_are_cut_finely():
    rng = np.random.default_rng(1)
    ends = rng.normal(0, 20, (200, 2, 3))
    way = rng.normal(0, 1, (200, 2, 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    handle = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None] / 3
    controls = np.stack(
        [ends[:, 0], ends[:, 0] + handle * way[:, 0], ends[:, 1] - handle * way[:, 1], ends[:, 1]],
        axis=1,
    )
    most = curvature(controls, np.linspace(0, 1, 4001)).max(axis=1)
    ratio = curvature_bound(controls, 128).max(axis=1) / most
    assert (ratio >= 1.0 - 1e-6).all()
    assert np.percentile(ratio, 90) < 1.1


def test_a_bend_between_the_places_that_used_to_be_looked_at_is_seen():
    # all of the turn happens within a hundredth of the parameter
    sharp = np.array([[[0, 0, 0], [4, 0, 0], [0.011, 0.0, 0], [4, 0.05, 0]]], dtype=float)
    t = np.linspace(0, 1, 200_001)
    speed = speed_in_bends(sharp, 2.0)[0]
    own = speed[(t * bezier.INTERVALS).astype(int).clip(0, bezier.INTERVALS - 1)]
    across = own**2 * curvature(sharp, t)[0]
    assert across[own > CREEP].max() <= 2.0 * (1 + 1e-9)
    assert across[own > CREEP].max() > 1.0


def test_a_part_that_rests_in_a_bend_has_no_bound_and_one_that_only_rests_needs_none():
    assert (curvature_bound(np.ones((1, 4, 3)), 4) == 0.0).all()
    cusp = np.array([[[0, 0, 0], [3, 3, 0], [0, 3, 0], [3, 0, 0]]], dtype=float)
    assert np.isinf(curvature_bound(cusp, 1)).all()


@given(st.integers(0, 10_000), st.integers(1, 30), st.floats(0.1, 10.0))
def test_no_limit_is_ever_exceeded_and_no_speed_could_be_raised_alone(seed, count, acceleration):
    rng = np.random.default_rng(seed)
    length = rng.choice([0.0, 1e-4, 0.3, 5.0], count) * rng.uniform(0.5, 1.5, count)
    fastest, ends = rng.uniform(0.05, 6.0, count), rng.choice([0.0, 0.7, np.inf], count + 1)
    found = speed_profile(length, fastest, ends, acceleration=acceleration)
    assert (found.peak <= fastest + 1e-9).all()
    assert (found.speed <= ends).all()
    gain = np.abs(np.diff(found.speed**2))
    assert (gain <= 2.0 * acceleration * length + 1e-9).all()
    up, cruise, down = found.phases
    run = found.at(np.arange(count), found.duration)[0]
    np.testing.assert_allclose(run, length, atol=1e-6)
    assert min(up.min(), cruise.min(), down.min()) >= -1e-9
    cap = np.minimum(ends, np.minimum(np.r_[fastest, np.inf], np.r_[np.inf, fastest]))
    reach = np.sqrt(found.speed**2 + 1e-12)
    before = np.r_[np.inf, np.sqrt(found.speed[:-1] ** 2 + 2 * acceleration * length)]
    after = np.r_[np.sqrt(found.speed[1:] ** 2 + 2 * acceleration * length), np.inf]
    tight = np.minimum(cap, np.minimum(before, after))
    assert (reach >= tight - 1e-6).all()  # each speed is held down by a limit or a neighbour
