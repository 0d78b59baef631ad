"""The mesh of the no-fly hull against fields and solids whose hull is known."""

import numpy as np
import pytest

from planner.airspace.airspace import build_airspace
from planner.airspace.hull import FORMATS, hull_mesh, save_hull, surface_net
from planner.errors import PlannerError
from planner.scene.synthetic import scene_of, synthetic_block


def test_a_ball_is_closed_faces_outward_and_has_its_volume():
    import trimesh

    at = np.stack(np.meshgrid(*3 * [np.arange(24.0)], indexing="ij"), axis=-1)
    vertices, triangles = surface_net(np.linalg.norm(at - [11.3, 11.6, 12.1], axis=-1) - 8.0)
    ball = trimesh.Trimesh(vertices, triangles)
    assert ball.is_watertight
    assert ball.is_winding_consistent
    assert ball.volume == pytest.approx(4 / 3 * np.pi * 8.0**3, rel=0.03)
    away = np.linalg.norm(vertices - [11.3, 11.6, 12.1], axis=1)
    np.testing.assert_allclose(away, 8.0, atol=0.1)


def test_no_surface_is_no_mesh():
    vertices, triangles = surface_net(np.ones((3, 4, 5)))
    assert len(vertices) == len(triangles) == 0


def test_the_hull_of_a_block_lies_at_d_min_and_can_be_saved(tmp_path):
    import trimesh

    block = synthetic_block(2, size=(44.0, 44.0), buildings=2, spacing=1.5)
    space = build_airspace(scene_of(block), block.mesh, d_min=4.0, d_max=12.0)
    mesh = hull_mesh(space, cell=1.5)
    assert len(mesh) > 1000
    clearance = space.clearance_range(mesh.vertices)[0]
    inner = (mesh.vertices > space.low + 2.0).all(1) & (mesh.vertices < space.high - 2.0).all(1)
    assert np.abs(clearance[inner] - 4.0).max() < 1.5
    assert np.median(np.abs(clearance[inner] - 4.0)) < 0.15
    for ending in FORMATS:
        path = tmp_path / f"hull{ending}"
        save_hull(mesh, path)
        again = trimesh.load(path, force="mesh", process=False)
        assert len(again.faces) == len(mesh)
    with pytest.raises(PlannerError, match="format"):
        save_hull(mesh, tmp_path / "hull.doc")
    with pytest.raises(PlannerError, match="cannot be written"):
        save_hull(mesh, tmp_path / "none" / "hull.ply")
    with pytest.raises(ValueError, match="cell"):
        hull_mesh(space, cell=0.0)
