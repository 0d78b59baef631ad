"""Terrain comes out under what stands on it; courtyards and hills stay."""

import numpy as np
import pytest

from planner.scene.ground import estimate_ground


def town(slope=0.0, hill=0.0, seed=0, noise=0.02, *, floor_seen=True):
    """Points of a 120 x 100 m block with a courtyard, a tower, a shed and a tree, and its terrain.

    A scan from above: every point is the highest at its place, facades are thin.
    """
    rng = np.random.default_rng(seed)
    xy = rng.random((60_000, 2)) * [120.0, 100.0]

    def terrain(at):
        bump = hill * np.exp(-((at[:, 0] - 95) ** 2 + (at[:, 1] - 70) ** 2) / 500.0)
        return slope * at[:, 0] + bump

    def within(x0, x1, y0, y1):
        return (xy[:, 0] > x0) & (xy[:, 0] < x1) & (xy[:, 1] > y0) & (xy[:, 1] < y1)

    rise = np.zeros(len(xy))
    rise[within(20, 70, 20, 70)] = 15.0  # a block 50 m wide
    rise[within(35, 55, 35, 55)] = 0.0  # its courtyard
    rise[within(80, 88, 10, 22)] = 45.0
    rise[within(100, 106, 20, 25)] = 2.5
    tree = np.linalg.norm(xy - [15, 85], axis=1) < 5
    rise[tree] = rng.uniform(3, 9, tree.sum())
    seen = floor_seen | (rise > 0)
    z = terrain(xy) + rise + rng.normal(0, noise, len(xy))
    return np.column_stack([xy, z])[seen], terrain, rise[seen]


@pytest.mark.parametrize(("slope", "hill"), [(0.0, 0.0), (0.1, 0.0), (0.0, 6.0), (0.1, 4.0)])
def test_buildings_go_and_courtyards_and_hills_stay(slope, hill):
    xyz, terrain, rise = town(slope, hill)
    ground = estimate_ground(xyz, cell=1.0)
    error = ground.height(xyz) - terrain(xyz)
    # bare cells hold the low end of their own points; under buildings it is interpolated
    assert np.abs(error[rise == 0]).max() < 0.5 + slope
    assert np.abs(error).max() < 1.0 + 2.0 * slope
    court = (np.abs(xyz[:, :2] - 45) < 8).all(axis=1)
    assert np.abs(error[court]).max() < 0.3 + slope


def test_points_under_the_street_do_not_dig_holes():
    xyz, terrain, _ = town()
    low = xyz[::400] - [0, 0, 6.0]
    ground = estimate_ground(np.concatenate([xyz, low]), cell=1.0)
    assert np.abs(ground.height(xyz) - terrain(xyz)).max() < 0.5


def test_classes_decide_where_there_are_any():
    xyz, terrain, rise = town(slope=0.1)
    classes = np.where(rise > 0, 6, 2).astype(np.uint8)
    ground = estimate_ground(xyz, cell=1.0, classes=classes)
    assert np.abs(ground.height(xyz) - terrain(xyz)).max() < 0.3
    # class codes that name no ground leave it to the heights
    same = estimate_ground(xyz, cell=1.0, classes=np.ones(len(xyz), dtype=np.uint8))
    np.testing.assert_array_equal(same.heights, estimate_ground(xyz, cell=1.0).heights)


def test_a_lone_tower_stands_on_its_feet():
    """Only walls and roof are there; the roof must not be taken for a plateau."""
    rng = np.random.default_rng(0)
    turn = rng.random(20_000) * 2 * np.pi
    walls = np.column_stack([8 * np.cos(turn), 8 * np.sin(turn), rng.random(20_000) * 60])
    disc = 8 * np.sqrt(rng.random(2_000)), rng.random(2_000) * 2 * np.pi
    roof = np.column_stack(
        [disc[0] * np.cos(disc[1]), disc[0] * np.sin(disc[1]), np.full(2000, 60)]
    )
    ground = estimate_ground(np.concatenate([walls, roof]), cell=0.5, low=0.0)
    assert ground.heights.max() < 3.0


def test_one_point_and_no_point():
    ground = estimate_ground(np.array([[3.0, 4.0, 5.0]]), cell=1.0)
    np.testing.assert_array_equal(ground.heights, [[5.0]])
    with pytest.raises(ValueError, match="0 and 1"):
        estimate_ground(np.empty((0, 3)), cell=1.0)
    with pytest.raises(ValueError, match="1 and 0"):
        estimate_ground(np.zeros((1, 3)), cell=0.0)


@pytest.mark.parametrize("shape", [(40, 30), (61, 47), (9, 120)])
def test_a_gap_in_a_slope_is_filled_as_the_slope(shape):
    x, y = np.meshgrid(*(np.arange(n) + 0.5 for n in shape), indexing="ij")
    slope = 3.0 + 0.2 * x - 0.1 * y
    hole = (np.hypot(x - 0.5 * shape[0], y - 0.5 * shape[1]) < 0.4 * min(shape)).ravel()
    xyz = np.column_stack([x.ravel(), y.ravel(), slope.ravel()])
    edge = np.array([[0.0, 0.0, 3.0], [*shape, slope[-1, -1]]])
    ground = estimate_ground(np.concatenate([xyz[~hole], edge]), cell=1.0)
    assert np.abs(ground.height(xyz) - xyz[:, 2])[hole].max() < 0.35
