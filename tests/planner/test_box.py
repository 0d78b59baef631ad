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


def walls_at(azimuth_deg, seed=4):
    """Normals of walls at one azimuth, of roofs and of trees."""
    rng = np.random.default_rng(seed)
    quarter = rng.integers(0, 4, 800) * 0.5 * np.pi
    angle = np.radians(azimuth_deg) + quarter + rng.normal(0, np.radians(2.0), 800)
    walls = np.column_stack([np.cos(angle), np.sin(angle), rng.normal(0, 0.1, 800)])
    roofs = np.tile([0.0, 0.0, 1.0], (3_000, 1))
    trees = rng.normal(size=(400, 3))
    trees /= np.linalg.norm(trees, axis=1, keepdims=True)
    return np.concatenate([walls, roofs, trees])


def tile(width, depth, *, seed=4):
    """Points of a rectangular tile, corners included."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    inside = np.random.default_rng(seed).random((500, 3))
    return np.concatenate([corners, inside]) * [width, depth, 20.0]


def azimuth_of(box):
    return np.degrees(np.arctan2(box.axes[0, 1], box.axes[0, 0]))


@pytest.mark.parametrize("azimuth_deg", [0.0, 0.2, 17.3, 44.9, 45.0, 89.9, 133.0])
def test_it_follows_the_walls_where_the_crop_says_nothing(azimuth_deg):
    """Walls at one azimuth among noise, in a crop that is as long in all directions."""
    xyz = tile(80.0, 80.0)[4:]
    xyz = xyz[np.hypot(*(xyz[:, :2] - 40.0).T) < 40.0]
    box = bounding_box(xyz, walls_at(azimuth_deg))
    check(box, xyz)
    off = (azimuth_of(box) - azimuth_deg + 45.0) % 90.0 - 45.0
    assert abs(off) < 0.5


@settings(deadline=None)
@given(st.floats(0.0, 180.0), st.floats(0.0, 2 * np.pi))
def test_a_square_tile_gives_its_side_whatever_way_its_walls_and_itself_lie(walls_deg, turn):
    xyz, walls = tile(100.0, 100.0), walls_at(walls_deg)
    box = bounding_box(turned(xyz, turn), turned(walls, turn))
    check(box, turned(xyz, turn))
    assert 100.0 - 1e-6 <= box.size[0] <= 105.0
    assert box.size[0] == pytest.approx(bounding_box(xyz, walls).size[0], rel=0.05)


@pytest.mark.parametrize(("width", "depth"), [(250.0, 250.0), (60.0, 240.0), (300.0, 200.0)])
@pytest.mark.parametrize("walls_deg", [20.0, 45.0, 66.0])
def test_a_crop_across_the_walls_is_boxed_as_it_was_cropped(width, depth, walls_deg):
    box = bounding_box(tile(width, depth), walls_at(walls_deg))
    np.testing.assert_allclose(np.sort(box.size[:2]), np.sort([width, depth]), atol=1e-6)


def test_a_strip_is_not_boxed_across_although_that_is_shorter():
    box = bounding_box(tile(100.0, 5.0), walls_at(45.0))
    np.testing.assert_allclose(box.size[:2], [100.0, 5.0], atol=1e-6)


def test_walls_a_little_off_the_crop_are_followed():
    box = bounding_box(tile(90.0, 70.0), walls_at(2.0))
    assert azimuth_of(box) == pytest.approx(2.0, abs=0.5)


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
