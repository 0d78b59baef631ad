"""The gradient of Eq. 1: length 1 over a measured sheet, nothing in a hole, no seams."""

import numpy as np
import pytest

from planner.scene.cloud import PointCloud
from planner.surface.field import poisson_gradient, smoothed_normals

SPACING, WIDTH = 0.25, 0.5


def sheet(hole=0.0, size=16.0):
    axis = np.arange(0.0, size, SPACING)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    xyz = np.column_stack([x.ravel(), y.ravel(), 0.31 * np.ones(x.size)])
    away = np.linalg.norm(xyz[:, :2] - size / 2, axis=1) >= hole
    return PointCloud(xyz[away], np.tile([0.0, 0, 1], (int(away.sum()), 1)))


def at(*places):
    return np.array([[x, y, 0.31] for x, y in places])


@pytest.mark.parametrize("gradient", [smoothed_normals, poisson_gradient])
def test_a_flat_sheet_has_a_unit_gradient_along_its_normal(gradient):
    cloud = sheet()
    got = gradient(cloud, at((8.0, 8.0), (7.9, 6.3)), width=WIDTH, area=np.full(len(cloud), 0.0625))
    np.testing.assert_allclose(got, np.tile([0.0, 0, 1], (2, 1)), atol=0.12)


@pytest.mark.parametrize("gradient", [smoothed_normals, poisson_gradient])
def test_a_hole_has_much_less(gradient):
    cloud = sheet(hole=2.5)
    got = gradient(cloud, at((8.0, 8.0), (8.0, 3.0)), width=WIDTH, area=np.full(len(cloud), 0.0625))
    assert abs(got[0, 2]) < 0.3 * got[1, 2]


def test_the_poisson_gradient_has_no_curl_where_the_normals_have():
    """Level normals on a level sheet are pure shear: no function has that gradient."""
    cloud = sheet()
    level = PointCloud(cloud.xyz, np.tile([1.0, 0, 0], (len(cloud), 1)))
    area = np.full(len(cloud), 0.0625)
    middle = at((8.0, 8.0))
    assert smoothed_normals(level, middle, width=WIDTH, area=area)[0, 0] > 0.9
    assert abs(poisson_gradient(level, middle, width=WIDTH, area=area)[0, 0]) < 0.15


def test_blocks_leave_no_seams():
    rng = np.random.default_rng(0)
    cloud = sheet(size=32.0)
    area = np.full(len(cloud), 0.0625)
    where = np.column_stack([rng.uniform(8, 24, (60, 2)), np.full(60, 0.31)])
    small = poisson_gradient(cloud, where, width=WIDTH, area=area, block=64)
    large = poisson_gradient(cloud, where, width=WIDTH, area=area, block=112)
    np.testing.assert_allclose(small, large, atol=0.05)
    np.testing.assert_allclose(large[:, 2], 1.0, atol=0.1)


def test_no_sample_has_no_gradient():
    cloud = sheet()
    for gradient in (smoothed_normals, poisson_gradient):
        none = gradient(cloud, np.empty((0, 3)), width=WIDTH, area=np.ones(len(cloud)))
        assert none.shape == (0, 3)


def test_a_cloud_without_normals_is_refused():
    with pytest.raises(ValueError, match="normals"):
        smoothed_normals(PointCloud(np.zeros((1, 3))), at((0, 0)), width=1.0, area=np.ones(1))
