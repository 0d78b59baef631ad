"""The outside is where the open sky is seen, whatever the triangles say."""

import numpy as np
import pytest

from planner.scene.cloud import Mesh
from planner.surface.openness import openness


def box(size=10.0):
    corner = np.array(list(np.ndindex(2, 2, 2)), dtype=float) * size
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [[q[0], q[1], q[2]] for q in quads] + [[q[0], q[2], q[3]] for q in quads]
    return Mesh(corner, np.array(triangles))


ROOF = (np.array([[5.0, 5.0, 10.0]]), np.array([[0.0, 0.0, 1.0]]))
WALL = (np.array([[10.0, 5.0, 5.0]]), np.array([[1.0, 0.0, 0.0]]))
FLOOR = (np.array([[5.0, 5.0, 0.0]]), np.array([[0.0, 0.0, -1.0]]))


@pytest.mark.parametrize("seed", range(4))
def test_a_closed_box_is_open_outside_and_shut_inside_for_any_winding(seed):
    rng = np.random.default_rng(seed)
    mesh = box()
    flipped = np.where(rng.random((12, 1)) < 0.5, mesh.triangles, mesh.triangles[:, ::-1])
    for xyz, normal in (ROOF, WALL):
        outward = openness(Mesh(mesh.vertices, flipped), xyz, normal, lift=0.01)
        inward = openness(Mesh(mesh.vertices, flipped), xyz, -normal, lift=0.01)
        assert outward.front == 1.0
        assert outward.back == inward.front == 0.0
        assert inward.back == 1.0


def test_a_floor_is_open_only_from_below():
    sides = openness(box(), *FLOOR, lift=0.01)
    assert sides.front == sides.back == 0.0
    assert sides.front_below == 1.0


def test_a_free_standing_wall_is_open_on_both_sides():
    wall = Mesh(np.array([[0, -5.0, 0], [0, 5.0, 0], [0, 0, 9.0]]), np.array([[0, 1, 2]]))
    sides = openness(wall, np.array([[0.0, 0, 3]]), np.array([[1.0, 0, 0]]), lift=0.01)
    assert sides.front == sides.back == 1.0


def test_a_roof_above_halves_what_is_open():
    eave = Mesh(
        np.array([[-50.0, -50, 10], [50, -50, 10], [50, 50, 10], [-50, 50, 10]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    ground = np.array([[0.0, 0.0, 0.0], [49.0, 0.0, 0.0]])
    sides = openness(eave, ground, np.tile([0.0, 0, 1], (2, 1)), lift=0.01)
    assert sides.front[0] < 0.25
    assert 0.4 < sides.front[1] < 0.8
