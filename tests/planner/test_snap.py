"""Snapping pulls a rounded surface onto its points, and leaves what has none."""

import numpy as np
import pytest

from planner.scene.cloud import Mesh, PointCloud
from planner.surface.snap import snap_to_cloud, vertex_normals


def bumpy_sheet(height, size=11):
    axis = np.arange(size, dtype=float) * 0.5
    x, y = np.meshgrid(axis, axis, indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height)])
    i = (np.arange(size - 1)[:, None] * size + np.arange(size - 1)).ravel()
    triangles = np.vstack(
        [np.column_stack([i, i + size, i + size + 1]), np.column_stack([i, i + size + 1, i + 1])]
    )
    return Mesh(vertices, triangles)


def plane_cloud(rotate, up=1.0):
    axis = np.arange(-2.0, 8.0, 0.25)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    xyz = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return PointCloud(xyz @ rotate.T, np.tile(rotate @ [0, 0, up], (len(xyz), 1)))


@pytest.mark.parametrize("seed", range(3))
def test_vertices_land_on_the_plane_of_the_points_however_it_is_turned(seed):
    rotate = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    rotate *= np.linalg.det(rotate)
    mesh = bumpy_sheet(0.3)
    turned = Mesh(mesh.vertices @ rotate.T, mesh.triangles)
    got = snap_to_cloud(turned, plane_cloud(rotate), reach=0.8)
    flat = got.vertices @ rotate
    np.testing.assert_allclose(flat[:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(flat[:, :2], mesh.vertices[:, :2], atol=1e-9)


def test_points_that_face_the_other_way_do_not_pull():
    mesh = bumpy_sheet(0.3)
    got = snap_to_cloud(mesh, plane_cloud(np.eye(3), up=-1.0), reach=0.8)
    np.testing.assert_array_equal(got.vertices, mesh.vertices)


def test_where_no_point_is_near_the_surface_stays():
    mesh = bumpy_sheet(3.0)
    got = snap_to_cloud(mesh, plane_cloud(np.eye(3)), reach=0.8)
    np.testing.assert_array_equal(got.vertices, mesh.vertices)


def test_vertex_normals_are_unit_and_upward_on_a_level_sheet():
    np.testing.assert_allclose(
        vertex_normals(bumpy_sheet(1.0)), np.tile([0.0, 0, 1], (121, 1)), atol=1e-12
    )
