"""Eqs. 6 and 7 on geometry small enough to work out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.viewpoints.confidence import pair_confidence, viewing_confidence

ROOF = {"samples": np.zeros((1, 3)), "normals": np.array([[0.0, 0.0, 1.0]])}
LIMITS = {"d_min": 5.0, "d_max": 15.0, "max_angle": np.pi / 3}


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        ([0, 0, 10], 1.0),  # optimal distance, along the normal
        ([0, 0, 5], 0.0),  # Eq. 6 vanishes at d_min
        ([0, 0, 15], 0.0),  # and at d_max
        ([0, 0, 12.5], 0.75),  # halfway from d_opt to d_max
        ([0, 0, 7.5], 0.75),  # halfway from d_opt to d_min
        ([0, 0, 4.999], 0.0),
        ([0, 0, -10], 0.0),  # sample above the viewpoint
        ([0, 0, 0], 0.0),  # at the sample
        ([10 * np.sin(np.pi / 3), 0, 5], np.exp(-1)),  # Eq. 7 at max_angle
        ([10, 0, 0], np.exp(-4)),  # grazing: (1 - 0)^2 / (1 - 1/2)^2
        ([12.5 * np.sin(np.pi / 3), 0, 6.25], 0.75 * np.exp(-1)),  # the product
    ],
)
def test_confidence_matches_hand_worked_values(position, expected):
    got = viewing_confidence(np.array([position], dtype=float), **ROOF, **LIMITS)
    np.testing.assert_allclose(got, [[expected]], atol=1e-12)


@given(st.floats(0, 2 * np.pi), st.floats(0, np.pi / 2), st.floats(0.1, 30.0))
def test_confidence_is_a_share_and_ignores_heading(azimuth, tilt, distance):
    def at(angle):
        ray = [np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt)]
        return viewing_confidence(distance * np.array([ray]), **ROOF, **LIMITS)

    assert 0.0 <= at(azimuth)[0, 0] <= 1.0
    np.testing.assert_allclose(at(azimuth), at(0.0), atol=1e-7)


@given(st.floats(0, 20), st.floats(-1, 1), st.floats(-1, 1))
def test_turning_towards_the_normal_never_lowers_the_confidence(distance, one, other):
    low, high = sorted((one, other))
    got = pair_confidence([distance, distance], [low, high], **LIMITS)
    assert got[0] <= got[1]


def test_a_matrix_is_its_pairs():
    rng = np.random.default_rng(3)
    positions, samples = rng.normal(0, 8, (20, 3)), rng.normal(0, 8, (30, 3))
    normals = rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    got = viewing_confidence(positions, samples, normals, **LIMITS)
    for v, s in np.ndindex(20, 30):
        ray = positions[v] - samples[s]
        distance = np.linalg.norm(ray)
        alone = pair_confidence(distance, ray @ normals[s] / distance, **LIMITS)
        assert got[v, s] == pytest.approx(alone if ray[2] >= 0 else 0.0, abs=1e-12)


@pytest.mark.parametrize(
    "wrong", [{"d_min": 0.0}, {"d_min": 20.0}, {"max_angle": 0.0}, {"max_angle": 4.0}]
)
def test_limits_out_of_order_are_refused_with_their_values(wrong):
    with pytest.raises(ValueError, match="got"):
        viewing_confidence(np.ones((1, 3)), **ROOF, **{**LIMITS, **wrong})
