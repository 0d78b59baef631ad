"""What of a Poisson surface is believed: holes are filled, skirts are cut, crumbs fall."""

import numpy as np
import pytest

from planner.scene.cloud import Mesh
from planner.scene.scene import Ground
from planner.surface.trim import drop_crumbs, in_footprint, select_triangles, trim

LEVEL = Ground(np.zeros((1, 1)), np.zeros(2), 1.0)


def sheet(low, high, step=1.0, height=0.0):
    """A square sheet of triangles from ``low`` to ``high``."""
    axis = np.arange(low, high + step / 2, step)
    n = len(axis)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height)])
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.vstack(
        [np.column_stack([i, i + n, i + n + 1]), np.column_stack([i, i + n + 1, i + 1])]
    )
    return Mesh(vertices, triangles)


def points_without_disk(low, high, radius, step=0.5):
    points = sheet(low, high, step).vertices
    return points[np.linalg.norm(points[:, :2], axis=1) > radius]


def centroids(mesh):
    return mesh.vertices[mesh.triangles].mean(axis=1)


def test_a_hole_within_measured_surface_stays_and_the_skirt_around_it_goes():
    mesh = trim(
        sheet(-40, 40), points_without_disk(-20, 20, radius=9.0), LEVEL, radius=2.0, distance=5.0
    )
    middle = centroids(mesh)
    assert (np.abs(middle[:, :2]) <= 21.5).all()
    assert (np.linalg.norm(middle[:, :2], axis=1) < 4.0).sum() > 90


def test_a_hole_too_wide_to_believe_is_cut():
    mesh = trim(
        sheet(-80, 80),
        points_without_disk(-70, 70, radius=40.0, step=1.0),
        LEVEL,
        radius=2.0,
        distance=5.0,
    )
    assert np.linalg.norm(centroids(mesh), axis=1).min() > 30.0


def test_a_bubble_that_touches_no_measured_surface_goes():
    low = sheet(-20, 20)
    bubble = sheet(-6, 6, height=12.0)
    both = Mesh(
        np.vstack([low.vertices, bubble.vertices]),
        np.vstack([low.triangles, bubble.triangles + len(low.vertices)]),
    )
    mesh = trim(both, points_without_disk(-20, 20, 0.0), LEVEL, radius=2.0, distance=5.0)
    assert mesh.vertices[:, 2].max() == 0.0


def test_what_hangs_below_the_ground_goes_unless_it_was_measured():
    mesh = sheet(-10, 10)
    sunk = Mesh(mesh.vertices - [0, 0, 4.0], mesh.triangles)
    above = points_without_disk(-10, 10, radius=0.0)
    assert len(trim(sunk, above, LEVEL, radius=2.0, distance=9.0)) == 0
    pit = above - [0, 0, 4.0]
    assert len(trim(sunk, pit, LEVEL, radius=2.0, distance=9.0)) == len(mesh)


def test_crumbs_are_dropped_by_area():
    large, small = sheet(0, 5), sheet(10, 12)
    both = Mesh(
        np.vstack([large.vertices, small.vertices]),
        np.vstack([large.triangles, small.triangles + len(large.vertices)]),
    )
    assert len(drop_crumbs(both, smallest=3.9)) == len(both)
    np.testing.assert_array_equal(drop_crumbs(both, smallest=4.1).vertices, large.vertices)


def test_the_footprint_holds_its_holes_and_ends_half_a_radius_out():
    points = points_without_disk(-10, 10, radius=6.0)
    at = np.array([[0, 0, 0], [0, 0, 90.0], [10.8, 0, 0], [11.6, 0, 0], [500.0, 0, 0]])
    inside = in_footprint(at, points, 2.0)
    np.testing.assert_array_equal(inside, [True, True, True, False, False])


def test_gaps_between_sparse_points_belong_to_the_footprint():
    points = sheet(-30, 30, step=5.0).vertices
    at = np.random.default_rng(0).uniform(-30, 30, size=(200, 3))
    assert in_footprint(at, points, 2.0).all()


def test_selected_triangles_keep_their_shape_and_lose_idle_vertices():
    mesh = sheet(0, 3)
    keep = np.zeros(len(mesh), dtype=bool)
    keep[[4, 7]] = True
    part = select_triangles(mesh, keep)
    np.testing.assert_allclose(part.vertices[part.triangles], mesh.vertices[mesh.triangles[keep]])
    assert len(np.unique(part.triangles)) == len(part.vertices)


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_or_a_single_triangle_pass_through(count):
    mesh = Mesh(np.array([[0, 0, 0], [9.0, 0, 0], [0, 9.0, 0]]), np.array([[0, 1, 2]])[:count])
    got = trim(mesh, mesh.vertices, LEVEL, radius=1.0, distance=50.0)
    assert len(got) == count
