"""Real places: both clearances agree, candidates keep their distance to every raw point."""

import numpy as np
import pytest

from planner.airspace.airspace import build_airspace
from planner.airspace.candidates import candidate_positions
from planner.airspace.field import DistanceField
from planner.scene.load import load_scene
from planner.scene.synthetic import synthetic_scene


def check_place(scene, mesh, *, d_min, d_max, voxel):
    airspace = build_airspace(scene, mesh, d_min=d_min, d_max=d_max)
    grid = candidate_positions(airspace, box=scene.box, voxel=voxel, limit=1500)
    field = DistanceField.from_arrays(airspace.to_arrays())
    assert 300 < len(grid) <= 1500
    np.testing.assert_allclose(
        field.clearance(grid.positions), airspace.clearance(grid.positions), atol=1e-7
    )
    assert field.raw_distance(grid.positions).min() >= d_min
    assert (grid.positions[:, 2] >= scene.ground.height(grid.positions) + d_min).all()
    rng = np.random.default_rng(0)
    pairs = grid.positions[rng.integers(0, len(grid), (80, 2))]
    free = np.array([airspace.edge_is_free(a, b) for a, b in pairs])
    bound = field.lower_bound_along(pairs[:, 0], pairs[:, 1], tolerance=0.1 * d_min)
    assert 3 < free.sum() <= 80
    assert (bound[free] >= 0.9 * d_min - 1e-6).all()
    assert (bound[~free] < d_min).all()
    return airspace


def test_a_church_of_a_city_model(shared_data):
    scene = load_scene(shared_data / "scenes/meshes/lyon_church_vaulx.ply")
    airspace = check_place(scene, scene.mesh, d_min=2.0, d_max=12.0, voxel=4.0)
    roof = scene.cloud.xyz[scene.cloud.xyz[:, 2].argmax()]
    inside = roof * [1, 1, 0.5]
    assert airspace.clearance(inside[None])[0] < 0


@pytest.mark.parametrize("truth", [True, False])
def test_a_made_up_block(truth):
    scene = synthetic_scene(4, truth=truth, size=(60.0, 50.0), buildings=5)
    mesh = (
        scene.mesh if truth else synthetic_scene(4, truth=True, size=(60.0, 50.0), buildings=5).mesh
    )
    check_place(scene, mesh, d_min=2.5, d_max=25.0, voxel=3.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["toronto_city_hall.laz", "delft_ahn3_part1.laz"])
def test_an_airborne_scan(shared_data, name):
    from planner.surface.reconstruct import reconstruct_surface

    scene = load_scene(shared_data / "scenes/pointclouds" / name)
    size = float(scene.box.size.max())
    surface = reconstruct_surface(scene, radius=0.015 * size, poisson_depth=7)
    check_place(scene, surface.mesh, d_min=0.03 * size, d_max=0.3 * size, voxel=0.03 * size)
