"""The box follows the walls, holds every point, and is no larger than it must be."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.scene.box import bounding_box


def turned(xyz, azimuth):
    c, s = np.cos(azimuth), np.sin(azimuth)
    return xyz @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def check(box, xyz):
    np.testing.assert_allclose(box.axes @ box.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(box.axes) == pytest.approx(1.0)
    np.testing.assert_array_equal(box.axes[2], [0, 0, 1])
    assert box.size[0] >= box.size[1] - 1e-9
    assert box.contains(xyz, margin=1e-6).all()
    local = (xyz - box.centre) @ box.axes.T
    np.testing.assert_allclose(np.abs(local).max(axis=0), 0.5 * box.size, atol=1e-6)


@settings(deadline=None)
@given(st.floats(0, 2 * np.pi), st.integers(0, 100))
def test_without_walls_it_is_the_rectangle_of_least_area(azimuth, seed):
    rng = np.random.default_rng(seed)
    xyz = np.add(turned(rng.random((300, 3)) * [60, 20, 9], azimuth), [1000, -500, 7])
    box = bounding_box(xyz)
    check(box, xyz)
    ways = np.linspace(0, 0.5 * np.pi, 91)
    areas = [np.prod(np.ptp(turned(xyz, way), axis=0)[:2]) for way in ways]
    assert box.size[0] * box.size[1] <= min(areas) * (1 + 1e-9)


@pytest.mark.parametrize("azimuth_deg", [0.0, 0.2, 17.3, 44.9, 45.0, 89.9, 133.0])
def test_it_follows_the_walls_and_not_the_crop(azimuth_deg):
    """Walls at one azimuth among noise, in a crop that lies otherwise."""
    rng = np.random.default_rng(4)
    xyz = rng.random((500, 3)) * [80, 80, 20]
    quarter = rng.integers(0, 4, 800) * 0.5 * np.pi
    angle = np.radians(azimuth_deg) + quarter + rng.normal(0, np.radians(2.0), 800)
    walls = np.column_stack([np.cos(angle), np.sin(angle), rng.normal(0, 0.1, 800)])
    roofs = np.tile([0.0, 0.0, 1.0], (3_000, 1))
    trees = rng.normal(size=(400, 3))
    trees /= np.linalg.norm(trees, axis=1, keepdims=True)
    box = bounding_box(xyz, np.concatenate([walls, roofs, trees]))
    check(box, xyz)
    got = np.degrees(np.arctan2(box.axes[0, 1], box.axes[0, 0]))
    off = (got - azimuth_deg + 45.0) % 90.0 - 45.0
    assert abs(off) < 0.5


def test_walls_of_all_directions_say_nothing():
    rng = np.random.default_rng(4)
    xyz = rng.random((500, 3)) * [80, 40, 20]
    angle = rng.random(4_000) * 2 * np.pi
    walls = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(4_000)])
    np.testing.assert_array_equal(bounding_box(xyz, walls).axes, bounding_box(xyz).axes)


def test_few_points():
    with pytest.raises(ValueError, match="at least one"):
        bounding_box(np.empty((0, 3)))
    one = bounding_box(np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_allclose(one.centre, [1, 2, 3])
    np.testing.assert_array_equal(one.size, 0.0)
    line = bounding_box(np.array([[0.0, 0, 0], [3, 4, 0], [6, 8, 0]]))
    np.testing.assert_allclose(line.size, [10, 0, 0], atol=1e-12)
