"""Polygons become triangles that cover them exactly: same area, same winding, no corner lost."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.scene.readers.ears import join_holes
from planner.scene.readers.polygons import triangulate_faces, triangulate_rings


def area_vectors(xyz, triangles):
    a, b, c = np.moveaxis(xyz[triangles], 1, 0)
    return 0.5 * np.cross(b - a, c - a)


def shoelace(xy):
    after = np.roll(xy, -1, axis=0)
    return 0.5 * float((xy[:, 0] * after[:, 1] - xy[:, 1] * after[:, 0]).sum())


def lifted(xy):
    """Put a plane polygon on a steep roof far from zero."""
    plane = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]])
    return xy @ plane + [85_000.0, 447_000.0, 12.0]


def star(radii):
    """A polygon with many reflex corners, turning left."""
    angle = np.arange(len(radii)) * (2.0 * np.pi / len(radii))
    return np.column_stack([np.cos(angle), np.sin(angle)]) * np.array(radii)[:, None]


@given(st.lists(st.floats(0.2, 5.0), min_size=3, max_size=40))
def test_a_star_is_covered_by_upright_triangles_of_the_same_area(radii):
    xy = star(radii)
    xyz = lifted(xy)
    triangles = triangulate_rings(xyz, [np.arange(len(xy))])
    up = area_vectors(xyz, triangles) @ np.cross([0.6, 0.0, 0.8], [0.0, 1.0, 0.0])
    assert (up >= -1e-9).all()
    assert up.sum() == pytest.approx(abs(shoelace(xy)), rel=1e-6, abs=1e-6)
    assert len(triangles) <= len(xy) - 2


@given(
    st.lists(st.floats(6.0, 9.0), min_size=8, max_size=24),
    st.lists(st.booleans(), min_size=1, max_size=4),
)
def test_holes_stay_open(radii, turns):
    outer = star(radii)
    centres = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    holes = [
        star([1.0, 0.5] * 3)[:: 1 if turn else -1] + centre
        for turn, centre in zip(turns, centres, strict=False)
    ]
    xy = np.concatenate([outer, *holes])
    sizes = [len(outer), *(len(hole) for hole in holes)]
    rings = np.split(np.arange(len(xy)), np.cumsum(sizes)[:-1])
    triangles = triangulate_rings(lifted(xy), rings)
    flat = np.column_stack([xy, np.zeros(len(xy))])
    up = area_vectors(flat, triangles)[:, 2]
    assert (up >= -1e-9).all()
    wanted = shoelace(outer) - sum(abs(shoelace(hole)) for hole in holes)
    assert up.sum() == pytest.approx(wanted, rel=1e-6)
    middles = flat[triangles].mean(axis=1)[:, :2]
    for centre in centres[: len(turns)]:
        assert (np.linalg.norm(middles - centre, axis=1) > 0.25).all()
    assert len(triangles) <= len(xy) + 2 * len(holes) - 2


def test_a_bridge_does_not_pass_through_another_hole():
    square = np.array([[0, 0], [10, 0], [10, 10], [0, 10]], dtype=float)
    near, far = (
        np.array([[x, 4], [x, 6], [x + 1, 6], [x + 1, 4]], dtype=float) for x in (7.0, 4.0)
    )
    xy = np.concatenate([square, far, near])
    loop = join_holes(xy, [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]])
    assert len(loop) == 12 + 4
    assert shoelace(xy[loop]) == pytest.approx(100 - 2 - 2)


@pytest.mark.parametrize("first", range(4))
def test_a_dented_quad_is_cut_at_its_dent(first):
    """The dart's area is 2; cut along the wrong diagonal it would be more."""
    xyz = np.array([[0, 0, 0], [2, -2, 0], [1, 0, 0], [2, 2, 0]], dtype=float)
    face = np.roll(np.arange(4), first)[None]
    triangles = triangulate_faces("x.obj", xyz, [face])
    np.testing.assert_allclose(
        np.abs(area_vectors(xyz, triangles)).sum(), abs(shoelace(xyz[:, :2])), atol=1e-12
    )
    assert len(triangles) == 2


def test_mixed_faces_keep_their_winding():
    xyz = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 1.5, 0]], dtype=float)
    faces = [np.array([[0, 1, 2]]), np.array([[0, 3, 2, 1]]), np.array([[0, 1, 2, 4, 3]])]
    triangles = triangulate_faces("x.obj", xyz, faces)
    up = area_vectors(xyz, triangles)[:, 2]
    assert up[0] == pytest.approx(0.5)
    assert up[1:3].sum() == pytest.approx(-1.0)
    assert up[3:].sum() == pytest.approx(1.25)


def test_a_polygon_without_area_gives_nothing():
    xyz = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], dtype=float)
    assert len(triangulate_rings(xyz, [np.arange(4)])) == 0
    assert len(triangulate_faces("x.obj", xyz, [np.array([[0, 1]])])) == 0
