"""Exact projection: what is in the picture, at the horizon, at nadir and at the rim."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.geometry.angles import direction
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import camera_axes, elevation_range, in_frustum, picture_bounds

WIDE = Camera(width_px=400, height_px=200, focal_px=100.0)  # tangents 2 across, 1 up

yaws = st.floats(-180, 180)
pitches = st.floats(-90, 90)


def sees(ray, yaw, pitch, camera=WIDE):
    return bool(in_frustum(np.array(ray, dtype=float), yaw, pitch, camera))


@given(yaws, pitches)
def test_axes_are_a_right_handed_frame_without_roll(yaw, pitch):
    axes = camera_axes(yaw, pitch)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.cross(axes[0], axes[1]), -axes[2], atol=1e-12)
    np.testing.assert_allclose(axes[2], direction(yaw, pitch), atol=1e-12)
    assert axes[0, 2] == 0.0
    assert axes[1, 2] >= -1e-12


@pytest.mark.parametrize(
    ("ray", "inside"),
    [
        ([0, 1, 0], True),
        ([1.99, 1, 0], True),
        ([2.01, 1, 0], False),
        ([-1.99, 1, 0], True),
        ([-2.01, 1, 0], False),
        ([0, 1, 0.99], True),
        ([0, 1, 1.01], False),
        ([0, 1, -0.99], True),
        ([0, 1, -1.01], False),
        ([0, -1, 0], False),  # behind
        ([1.9, 1, 0.9], True),  # corner
        ([0, 0, 0], False),  # the camera itself
    ],
)
def test_level_camera_to_the_north(ray, inside):
    assert sees(ray, 0.0, 0.0) is inside


@pytest.mark.parametrize(
    ("yaw", "ray", "inside"),
    [
        (0.0, [1.9, 0, -1], True),  # the long side lies east to west
        (0.0, [0, 1.9, -1], False),
        (0.0, [0, 0.9, -1], True),
        (90.0, [1.9, 0, -1], False),  # turned east, the long side lies north to south
        (90.0, [0, 1.9, -1], True),
        (90.0, [0.9, 0, -1], True),
        (0.0, [0, 0, 1], False),
    ],
)
def test_at_nadir_the_yaw_still_turns_the_picture(yaw, ray, inside):
    assert sees(ray, yaw, -90.0) is inside


def test_an_offset_principal_point_moves_the_rim():
    camera = Camera(width_px=400, height_px=200, focal_px=100.0, principal_px=(100.0, 50.0))
    assert picture_bounds(camera) == (-1.0, 3.0, -1.5, 0.5)
    assert sees([2.9, 1, 0], 0.0, 0.0, camera)
    assert not sees([-1.1, 1, 0], 0.0, 0.0, camera)
    assert sees([0, 1, -1.4], 0.0, 0.0, camera)
    assert not sees([0, 1, 0.6], 0.0, 0.0, camera)


@given(
    yaws, pitches, st.floats(-180, 180), st.tuples(*[st.floats(-5, 5)] * 3), st.floats(0.1, 50.0)
)
def test_turning_scene_and_camera_about_z_changes_nothing(yaw, pitch, turn, ray, stretch):
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    turned = [c * ray[0] + s * ray[1], -s * ray[0] + c * ray[1], ray[2]]  # clockwise as the yaw
    axes = camera_axes(yaw, pitch)
    right, up, depth = axes @ np.array(ray)
    rim = min(abs(abs(right) - 2 * depth), abs(abs(up) - depth), abs(depth))
    if rim > 1e-6:  # nearer to the rim rounding decides
        assert sees(ray, yaw, pitch) == sees(turned, yaw + turn, pitch)
        assert sees(ray, yaw, pitch) == sees(np.array(ray) * stretch, yaw, pitch)


@given(yaws, st.floats(-1, 1), st.floats(-60, 20), st.floats(-40, 60))
def test_elevations_in_range_are_in_some_picture_and_others_in_none_of_the_middle(
    yaw, place, low, span
):
    camera = Camera(400, 200, 100.0, None, low, low + abs(span))
    bottom, top = elevation_range(camera)
    elevation = 0.5 * (bottom + top) + 0.499 * place * (top - bottom)
    pitch = np.clip(math.degrees(elevation), camera.pitch_min_deg, camera.pitch_max_deg)
    assert sees(direction(yaw, math.degrees(elevation)), yaw, pitch, camera)
    for beyond, limit in ((top + 0.01, camera.pitch_max_deg), (bottom - 0.01, low)):
        if abs(beyond) < math.pi / 2:
            assert not sees(direction(yaw, math.degrees(beyond)), yaw, limit, camera)


def test_default_gimbal_reaches_from_nadir_to_half_a_picture_above_the_horizon():
    low, high = elevation_range(Camera())
    assert low == -math.pi / 2
    assert high == pytest.approx(Camera().vertical_fov / 2)
