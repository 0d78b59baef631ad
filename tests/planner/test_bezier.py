"""Bezier pieces by hand, and as properties of any piece."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.geometry import bezier

PIECES = arrays(np.float64, (4, 3), elements=st.floats(-50, 50, allow_subnormal=False))


def dense(controls, count=2001):
    return bezier.evaluate(controls[None], np.linspace(0.0, 1.0, count))


def test_points_of_a_hand_worked_piece():
    arch = np.array([[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]], dtype=float)
    np.testing.assert_allclose(bezier.evaluate(arch, np.array(0.5)), [0.5, 0.75, 0.0])
    np.testing.assert_allclose(bezier.derivative(arch, np.array(0.0)), [0.0, 3.0, 0.0])
    np.testing.assert_allclose(bezier.derivative(arch, np.array(0.5)), [1.5, 0.0, 0.0])
    assert bezier.hull_radius(arch) == 1.0
    assert bezier.polygon_length(arch) == 3.0


def test_ends_are_exact():
    rng = np.random.default_rng(0)
    controls = rng.normal(size=(20, 4, 3))
    np.testing.assert_array_equal(bezier.evaluate(controls, np.zeros(20)), controls[:, 0])
    np.testing.assert_array_equal(bezier.evaluate(controls, np.ones(20)), controls[:, 3])


@given(PIECES)
def test_halves_trace_the_same_curve(controls):
    left, right = bezier.split(controls)
    at = np.linspace(0.0, 1.0, 41)
    np.testing.assert_array_equal(left[3], right[0])
    np.testing.assert_allclose(
        bezier.evaluate(left[None], at), bezier.evaluate(controls[None], at / 2), atol=1e-11
    )
    np.testing.assert_allclose(
        bezier.evaluate(right[None], at), bezier.evaluate(controls[None], 0.5 + at / 2), atol=1e-11
    )


@given(PIECES)
def test_no_point_is_farther_from_the_chord_than_the_hull_radius(controls):
    points = dense(controls, 301)
    start, chord = controls[0], controls[3] - controls[0]
    along = (points - start) @ chord / max(float(chord @ chord), 1e-300)
    nearest = start + along.clip(0, 1)[:, None] * chord
    assert np.linalg.norm(points - nearest, axis=1).max() <= bezier.hull_radius(controls) + 1e-9


@given(PIECES)
def test_hull_radius_falls_to_a_quarter_or_so_with_each_halving(controls):
    pieces = controls[None]
    before = float(np.linalg.norm(np.diff(controls, n=2, axis=0), axis=1).max())
    for _ in range(4):
        pieces = np.concatenate(bezier.split(pieces))
    # the distance of the polygon from its chord is bounded by its second differences
    assert bezier.hull_radius(pieces).max() <= 2.0 * before / 4**4 + 1e-9


@given(PIECES)
def test_length_lies_between_chord_and_polygon(controls):
    length = bezier.lengths(controls[None])[0]
    assert np.linalg.norm(controls[3] - controls[0]) <= length + 1e-6 * (1 + length)
    assert length <= bezier.polygon_length(controls) + 1e-6 * (1 + length)


def test_length_agrees_with_a_fine_polyline():
    controls = np.array([[0, 0, 0], [4, 0, 1], [5, 3, 2], [9, 9, 0]], dtype=float)
    fine = np.linalg.norm(np.diff(dense(controls, 400_001), axis=0), axis=1).sum()
    assert bezier.lengths(controls[None])[0] == pytest.approx(fine, rel=1e-9)


def test_straight_pieces_run_evenly():
    a, b = np.array([[1.0, 2, 3]]), np.array([[4.0, 6, 3]])
    controls = bezier.straight(a, b)
    np.testing.assert_allclose(
        bezier.evaluate(controls, np.array([0.3])), 0.7 * a + 0.3 * b, atol=1e-14
    )
    assert bezier.lengths(controls)[0] == pytest.approx(5.0)
    assert bezier.hull_radius(controls)[0] == pytest.approx(0.0, abs=1e-12)


def test_parameter_undoes_length():
    rng = np.random.default_rng(3)
    controls = np.cumsum(rng.normal((2.0, 0.0, 0.0), size=(30, 4, 3)), axis=1)
    share = rng.random(30)
    goal = share * bezier.lengths(controls)
    at = bezier.parameter_at(controls, np.arange(30), goal)
    left = np.empty(30)
    for k in range(30):  # length up to the parameter, by a much finer rule
        fine = bezier.evaluate(controls[k][None], np.linspace(0.0, at[k], 100_001))
        left[k] = np.linalg.norm(np.diff(fine, axis=0), axis=1).sum()
    np.testing.assert_allclose(left, goal, rtol=1e-7)


def test_parameter_of_a_piece_without_length_is_finite():
    controls = np.zeros((1, 4, 3))
    at = bezier.parameter_at(controls, np.array([0, 0]), np.array([0.0, 1.0]))
    assert ((at >= 0.0) & (at <= 1.0)).all()
