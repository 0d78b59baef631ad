"""Samples by radius: never too close, never a gap, the same for the same seed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from planner.scene.cloud import Mesh
from planner.scene.sampling import triangle_normals
from planner.surface.poisson_disk import least_radius, poisson_disk


def rectangle(width, depth, height=0.0):
    corners = [[0, 0, height], [width, 0, height], [width, depth, height], [0, depth, height]]
    return Mesh(np.array(corners, dtype=float), np.array([[0, 1, 2], [0, 2, 3]]))


@settings(max_examples=20, deadline=None)
@given(
    st.floats(1.0, 40.0),
    st.floats(0.5, 40.0),
    st.floats(0.3, 3.0),
    st.integers(0, 2**31),
    st.data(),
)
def test_no_two_samples_are_close_and_no_gap_is_left(width, depth, radius, seed, data):
    mesh = rectangle(width, depth)
    samples = poisson_disk(mesh, radius, seed=seed)
    tree = cKDTree(samples.xyz)
    assert len(tree.query_pairs(radius * (1.0 - 1e-9))) == 0
    share = np.array([data.draw(st.floats(0, 1)), data.draw(st.floats(0, 1)), 0.0])
    anywhere = share * [width, depth, 0.0]
    assert tree.query(anywhere)[0] <= 1.5 * radius


def test_samples_lie_on_the_triangle_that_they_name():
    rng = np.random.default_rng(3)
    mesh = Mesh(rng.normal(size=(30, 3)) * 5.0, rng.permutation(30).reshape(10, 3))
    samples = poisson_disk(mesh, 0.4, seed=1)
    normals, _ = triangle_normals(mesh)
    corner = mesh.vertices[mesh.triangles[samples.triangle, 0]]
    off = np.einsum("sc,sc->s", samples.xyz - corner, normals[samples.triangle])
    np.testing.assert_allclose(off, 0.0, atol=1e-9)
    low = mesh.vertices[mesh.triangles[samples.triangle]].min(axis=1)
    high = mesh.vertices[mesh.triangles[samples.triangle]].max(axis=1)
    assert ((samples.xyz >= low - 1e-9) & (samples.xyz <= high + 1e-9)).all()


def test_the_number_of_samples_is_that_of_random_close_disks():
    """Random disks of radius R/2 jam at 0.547 of a plane; finitely many darts come close."""
    samples = poisson_disk(rectangle(60.0, 60.0), 1.0, seed=0)
    covered = len(samples.xyz) * np.pi * 0.25 / 60.0**2
    assert 0.48 < covered < 0.56


def test_the_same_seed_draws_the_same_samples_and_another_does_not():
    mesh = rectangle(10.0, 10.0)
    first, again, other = (poisson_disk(mesh, 0.7, seed=s).xyz for s in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or not np.array_equal(first, other)


def test_distance_counts_across_sheets():
    two = rectangle(8.0, 8.0)
    above = rectangle(8.0, 8.0, height=0.2)
    both = Mesh(
        np.vstack([two.vertices, above.vertices]), np.vstack([two.triangles, above.triangles + 4])
    )
    samples = poisson_disk(both, 1.0, seed=2)
    assert len(cKDTree(samples.xyz).query_pairs(1.0 - 1e-9)) == 0


def test_a_mesh_without_area_has_no_samples():
    flat = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert len(poisson_disk(flat, 1.0).xyz) == 0


@pytest.mark.parametrize("radius", [0.0, -1.0, float("nan"), 1e-9])
def test_an_impossible_radius_is_refused(radius):
    with pytest.raises(ValueError, match="radius"):
        poisson_disk(rectangle(1.0, 1.0), radius)


@pytest.mark.parametrize("side", [0.3, 60.0, 7e4])
def test_the_least_radius_is_just_not_refused(side, monkeypatch):
    monkeypatch.setattr("planner.surface.poisson_disk._LIMIT", 50_000)
    mesh = rectangle(side, side)
    poisson_disk(mesh, least_radius(mesh))
    with pytest.raises(ValueError, match="darts"):
        poisson_disk(mesh, 0.99 * least_radius(mesh))
