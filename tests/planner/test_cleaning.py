"""Thinning keeps one real point a cell; cleaning takes what floats alone and nothing else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from planner.scene.cleaning import drop_outliers, stray_points, thin
from planner.scene.cloud import PointCloud


def uneven(seed, count):
    """A cloud whose density varies a hundredfold."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 3)) * rng.uniform(0.1, 10.0, (count, 1)) + [7e5, 5e6, 40.0]


@settings(deadline=None)
@given(st.integers(0, 1000), st.integers(1, 400), st.floats(0.05, 30.0))
def test_thinning_keeps_in_each_cell_the_point_nearest_to_its_mean(seed, count, spacing):
    xyz = uneven(seed, count)
    kept = thin(PointCloud(xyz), spacing).xyz
    cells = np.floor((xyz - xyz.min(axis=0)) / spacing).astype(int)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    assert len(kept) == cell.max() + 1
    for i in range(cell.max() + 1):
        members = xyz[cell == i]
        off = np.linalg.norm(members - members.mean(axis=0), axis=1)
        chosen = (kept[:, None] == members[None]).all(axis=2)
        assert chosen.any(axis=1).sum() == 1
        picked = off[chosen.any(axis=0)]
        assert picked.min() == pytest.approx(off.min(), abs=1e-6)


def test_thinning_carries_attributes_and_keeps_the_order():
    xyz = uneven(1, 500)
    rows = np.arange(500)
    cloud = PointCloud(
        xyz,
        np.tile([0.0, 0.0, 1.0], (500, 1)),
        np.column_stack([rows % 256] * 3).astype(np.uint8),
        (rows % 7).astype(np.uint8),
    )
    kept = thin(cloud, 3.0)
    where = np.array([np.flatnonzero((xyz == point).all(axis=1))[0] for point in kept.xyz])
    assert (np.diff(where) > 0).all()
    np.testing.assert_array_equal(kept.classes, where % 7)
    np.testing.assert_array_equal(kept.colours[:, 0], where % 256)
    assert len(thin(PointCloud(np.empty((0, 3))), 1.0)) == 0


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, 1e-9])
def test_an_impossible_spacing_is_an_error(spacing):
    with pytest.raises(ValueError, match="spacing"):
        thin(PointCloud(uneven(0, 50)), spacing)


def stray_by_definition(xyz, neighbours, sigma):
    tree = cKDTree(xyz)
    lonely = tree.query(xyz, k=neighbours + 1)[0][:, 1:].mean(axis=1)
    few = neighbours // 4
    reach, near = tree.query(xyz, k=few + 1)
    usual = np.median(reach[near[:, 1:], -1], axis=1)
    return (lonely > lonely.mean() + sigma * lonely.std()) & (reach[:, -1] > 3.0 * usual)


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_the_fast_search_finds_exactly_the_stray_points_of_the_definition(seed):
    rng = np.random.default_rng(seed)
    sheet = np.column_stack([rng.random((4_000, 2)) * 50, rng.normal(0, 0.1, 4_000)])
    sparse = rng.random((60, 3)) * [1, 40, 30] + [60, 0, 0]
    birds = rng.random((12, 3)) * [50, 50, 20] + [0, 0, 15]
    xyz = rng.permutation(np.concatenate([sheet, sparse, birds]))
    wanted = stray_by_definition(xyz, 8, 1.0)
    np.testing.assert_array_equal(stray_points(xyz, 8, 1.0), wanted)
    assert wanted.any()


def test_birds_go_but_mast_wire_and_sparse_facade_stay():
    rng = np.random.default_rng(3)
    street = np.column_stack([rng.random((30_000, 2)) * 60, rng.normal(0, 0.02, 30_000)])
    facade = np.column_stack([np.full(400, 30.0), rng.random(400) * 40, rng.random(400) * 40])
    mast = np.column_stack([np.full((40, 2), 10.0), np.linspace(0, 30, 40)])
    wire = np.column_stack([np.linspace(0, 60, 120), np.full((120, 1), 50.0), np.full(120, 20.0)])
    birds = np.array([[20.0, 20.0, 30.0], [50.0, 8.0, 25.0], [50.2, 8.0, 25.0]])
    xyz = np.concatenate([street, facade, mast, wire, birds])
    stray = stray_points(xyz, 16, 5.0)
    assert stray[-3:].all()
    assert not stray[:-3].any()
    assert len(drop_outliers(PointCloud(xyz), 16, 5.0)) == len(xyz) - 3


def test_a_clean_or_tiny_cloud_is_returned_itself():
    few = PointCloud(uneven(0, 10))
    assert drop_outliers(few, 16, 5.0) is few
    same = PointCloud(np.zeros((100, 3)))
    assert drop_outliers(same, 16, 5.0) is same
