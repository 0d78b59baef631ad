"""Samples follow the area; the cover leaves no gap."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from planner.scene.cloud import Mesh
from planner.scene.sampling import cover_mesh, sample_mesh, triangle_normals


def random_mesh(seed, count=6):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(3 * count, 3)) * 5.0 + [100.0, 200.0, 3.0]
    return Mesh(vertices, np.arange(3 * count).reshape(-1, 3))


def barycentric(mesh, face, points):
    a, b, c = mesh.vertices[mesh.triangles[face]]
    weights, *_ = np.linalg.lstsq(
        np.vstack([np.column_stack([a, b, c]), np.ones(3)]),
        np.vstack([points.T, np.ones(len(points))]),
    )
    return weights.T


@given(st.integers(0, 100), st.floats(0.2, 2.0))
@settings(deadline=None, max_examples=30)
def test_each_triangle_gets_its_share_to_within_one_point(seed, spacing):
    mesh = random_mesh(seed)
    normals, areas = triangle_normals(mesh)
    cloud = sample_mesh(mesh, spacing, seed)
    assert len(cloud) == max(1, round(areas.sum() / spacing**2))
    face = np.argmax(cloud.normals @ normals.T, axis=1)  # normals of random triangles differ
    np.testing.assert_allclose(cloud.normals, normals[face])
    got = np.bincount(face, minlength=len(mesh))
    assert (np.abs(got - len(cloud) * areas / areas.sum()) <= 1.0 + 1e-9).all()
    for i in range(len(mesh)):
        weights = barycentric(mesh, i, cloud.xyz[face == i])
        assert (weights >= -1e-9).all()


def test_points_fill_a_triangle_evenly():
    mesh = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    cloud = sample_mesh(mesh, 0.005, 0)
    np.testing.assert_allclose(cloud.xyz.mean(axis=0), [1 / 3, 1 / 3, 0], atol=0.01)
    corner = (cloud.xyz[:, :2] < 0.5).all(axis=1) & (cloud.xyz[:, :2].sum(axis=1) < 0.5)
    assert corner.mean() == pytest.approx(0.25, abs=0.02)


def test_the_same_seed_gives_the_same_points():
    mesh = random_mesh(1)
    np.testing.assert_array_equal(sample_mesh(mesh, 0.5, 3).xyz, sample_mesh(mesh, 0.5, 3).xyz)
    assert (sample_mesh(mesh, 0.5, 3).xyz != sample_mesh(mesh, 0.5, 4).xyz).any()


@pytest.mark.parametrize("seed", range(4))
def test_the_cover_leaves_no_gap_and_takes_edges_and_corners(seed):
    mesh, step = random_mesh(seed), 0.4
    cover = cover_mesh(mesh, step)
    probe = sample_mesh(mesh, 0.1, 0).xyz
    edges = mesh.vertices[mesh.triangles]
    share = np.linspace(0, 1, 50)[:, None, None, None]
    rims = (edges * share + np.roll(edges, 1, axis=1) * (1 - share)).reshape(-1, 3)
    off, _ = cKDTree(cover).query(np.concatenate([probe, rims]))
    assert off.max() <= np.sqrt(0.5) * step + 1e-9
    assert cKDTree(cover).query(mesh.vertices)[0].max() < 1e-9
    sides = np.linalg.norm(np.roll(edges, 1, axis=1) - edges, axis=2).sum()
    area = triangle_normals(mesh)[1].sum()
    assert len(cover) < area / step**2 + 2 * sides / step + 10 * len(mesh)


def test_triangles_without_area_are_harmless():
    mesh = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]]), [[0, 1, 2], [0, 1, 3]])
    normals, areas = triangle_normals(mesh)
    np.testing.assert_array_equal(normals, [[0, 0, 1], [0, 0, 1]])
    np.testing.assert_array_equal(areas, [0.0, 0.5])
    assert np.isfinite(cover_mesh(mesh, 0.1)).all()
    with pytest.raises(ValueError, match="area 0"):
        sample_mesh(Mesh(mesh.vertices, mesh.triangles[:1]), 0.1, 0)
    for call in (lambda: sample_mesh(mesh, 0.0, 0), lambda: cover_mesh(mesh, -1.0)):
        with pytest.raises(ValueError, match="must be positive"):
            call()
