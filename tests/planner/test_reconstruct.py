"""From a scene to samples: on the surface, outside, facing out, the same each time."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from planner.config import SurfaceSettings
from planner.errors import PlannerError
from planner.geometry.frames import Frame
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.sampling import sample_mesh
from planner.scene.scene import Box, Ground, Scene
from planner.surface.quality import score_quality
from planner.surface.reconstruct import reconstruct_surface

RADIUS = 1.0


def block(low, high):
    """A closed box with outward triangles."""
    corner = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [[q[0], q[k], q[k + 1]] for q in quads for k in (1, 2)]
    return Mesh(np.array(low) + corner * np.subtract(high, low), np.array(triangles))


def house_on_ground():
    ground = block((-14, -14, -0.5), (14, 14, 0.0))
    house = block((-5, -4, 0.0), (5, 4, 7.0))
    return Mesh(
        np.vstack([ground.vertices, house.vertices]),
        np.vstack([ground.triangles, house.triangles + 8]),
    )


def scene_of(cloud, mesh=None):
    low, high = cloud.xyz.min(axis=0), cloud.xyz.max(axis=0)
    return Scene(
        "house",
        cloud,
        mesh,
        Ground(np.zeros((4, 4)), np.array([-20.0, -20.0]), 10.0),
        Box(0.5 * (low + high), np.eye(3), high - low),
        Frame(np.zeros(3)),
    )


@pytest.fixture(scope="module")
def seen_from_above():
    """Ground and roof densely, walls not at all: what a nadir flight would give."""
    points = sample_mesh(house_on_ground(), 0.2, 0)
    roof = (points.xyz[:, 2] > 6.99) | (
        (np.abs(points.xyz[:, 2]) < 1e-9) & ~_under_house(points.xyz)
    )
    return scene_of(PointCloud(points.xyz[roof]))


def _under_house(xyz):
    return (np.abs(xyz[:, 0]) < 5.0) & (np.abs(xyz[:, 1]) < 4.0)


@pytest.fixture(scope="module")
def surface(seen_from_above):
    return reconstruct_surface(seen_from_above, radius=RADIUS, poisson_depth=7)


def test_samples_keep_their_distance_and_their_clusters(surface):
    samples = surface.samples
    assert len(cKDTree(samples.xyz).query_pairs(RADIUS * (1 - 1e-9))) == 0
    np.testing.assert_allclose(np.linalg.norm(samples.normals, axis=1), 1.0)
    assert set(samples.cluster) == set(range(round(len(samples) / 400)))


def test_samples_lie_on_what_was_measured_and_between(surface, seen_from_above):
    xyz = surface.samples.xyz
    near = cKDTree(seen_from_above.cloud.xyz).query(xyz)[0] < 0.3
    measured = np.minimum(np.abs(xyz[near, 2]), np.abs(xyz[near, 2] - 7.0))
    assert np.quantile(measured, 0.9) < 0.1
    walls = xyz[(xyz[:, 2] > 1.5) & (xyz[:, 2] < 5.5)]
    assert len(walls) > 75  # the facades that nobody saw


def test_no_sample_is_inside_or_below_and_all_look_out(surface):
    xyz, normals = surface.samples.xyz, surface.samples.normals
    inside = (np.abs(xyz[:, 0]) < 3.5) & (np.abs(xyz[:, 1]) < 2.5) & (xyz[:, 2] < 5.5)
    assert not inside.any()
    assert xyz[:, 2].min() > -RADIUS
    roof = (np.abs(xyz[:, 0]) < 4) & (np.abs(xyz[:, 1]) < 3)
    assert (normals[roof, 2] > 0.9).all()
    walls = (xyz[:, 2] > 2.0) & (xyz[:, 2] < 5.0)
    away = xyz[walls, :2] / np.linalg.norm(xyz[walls, :2], axis=1, keepdims=True)
    assert np.quantile(np.einsum("sc,sc->s", normals[walls, :2], away), 0.02) > 0.0


def test_without_walls_the_surface_has_a_waist(surface, seen_from_above):
    """Why walls are stood: Poisson alone joins roof and ground inside of the house."""
    paper = reconstruct_surface(
        seen_from_above, radius=RADIUS, poisson_depth=6, settings=SurfaceSettings(walls=False)
    )
    for mesh, waist in ((paper.mesh, True), (surface.mesh, False)):
        xyz = mesh.vertices[(mesh.vertices[:, 2] > 2.0) & (mesh.vertices[:, 2] < 5.0), :2]
        inside = np.minimum(5.0 - np.abs(xyz[:, 0]), 4.0 - np.abs(xyz[:, 1]))
        assert (np.median(inside) > 0.5) == waist


def test_samples_cover_the_truth(surface):
    truth = sample_mesh(house_on_ground(), 0.5, 1).xyz
    outer = (truth[:, 2] >= 0.0) & ~(_under_house(truth) & (truth[:, 2] < 6.9))
    outer &= np.abs(truth[:, :2]).max(axis=1) < 13.0
    away = cKDTree(surface.samples.xyz).query(truth[outer])[0]
    assert np.quantile(away, 0.95) < 1.5 * RADIUS
    assert away.max() < 3.5 * RADIUS


def test_unseen_facades_score_lowest(surface, seen_from_above):
    scored = score_quality(surface.samples, seen_from_above.cloud, thinned=surface.thinned)
    walls = (scored.xyz[:, 2] > 2.0) & (scored.xyz[:, 2] < 5.0)
    plain = (np.abs(scored.xyz[:, :2]).max(axis=1) > 8.0) & (
        np.abs(scored.xyz[:, :2]).max(axis=1) < 12.5
    )
    assert scored.quality[walls].max() < 0.05
    assert np.quantile(scored.quality[plain], 0.05) > 0.6


def test_the_same_scene_gives_the_same_samples(surface, seen_from_above):
    again = reconstruct_surface(seen_from_above, radius=RADIUS, poisson_depth=7)
    np.testing.assert_array_equal(again.samples.xyz, surface.samples.xyz)
    np.testing.assert_array_equal(again.samples.normals, surface.samples.normals)
    np.testing.assert_array_equal(again.mesh.vertices, surface.mesh.vertices)


@pytest.mark.parametrize("seed", range(3))
def test_a_mesh_is_its_own_surface_whatever_its_winding(seed):
    mesh = house_on_ground()
    flip = np.random.default_rng(seed).random((len(mesh), 1)) < 0.5
    soup = Mesh(mesh.vertices, np.where(flip, mesh.triangles, mesh.triangles[:, ::-1]))
    cloud = sample_mesh(mesh, 0.2, 0)
    surface = reconstruct_surface(scene_of(cloud, soup), radius=RADIUS, poisson_depth=7)
    xyz, normals = surface.samples.xyz, surface.samples.normals
    assert surface.mesh is soup
    centre = np.array([0.0, 0.0, 3.5])
    house = (np.abs(xyz) <= [5.0, 4.0, 7.0]).all(axis=1) & (xyz[:, 2] > 0.5)
    assert (np.einsum("sc,sc->s", normals[house], xyz[house] - centre) > 0.0).all()
    assert (normals[~house, 2] > -0.1).all()
    assert not (_under_house(xyz) & (xyz[:, 2] < 0.1)).any()


def test_the_number_of_clusters_can_be_set(seen_from_above):
    surface = reconstruct_surface(
        seen_from_above, radius=2.0, poisson_depth=6, settings=SurfaceSettings(clusters=5)
    )
    assert set(surface.samples.cluster) == set(range(5))


def test_a_surface_that_cannot_be_reached_is_refused_with_a_remedy():
    shut = block((-5, -5, 0), (5, 5, 5))
    around = block((-9, -9, -4), (9, 9, 9))
    inner = PointCloud(sample_mesh(shut, 0.5, 0).xyz)
    both = Mesh(
        np.vstack([shut.vertices, around.vertices]),
        np.vstack([shut.triangles, around.triangles + 8]),
    )
    hidden = scene_of(inner, both)
    assert len(reconstruct_surface(hidden, radius=2.0, poisson_depth=6).samples) > 0
    buried = Mesh(
        np.array([[0, 0, -50.0], [9.0, 0, -50.0], [0, 9.0, -50.0]]), np.array([[0, 1, 2]])
    )
    with pytest.raises(PlannerError, match=r"house: no surface sample.*set scale\.radius between"):
        reconstruct_surface(scene_of(inner, buried), radius=2.0, poisson_depth=6)


def test_more_samples_than_fit_are_refused_with_a_radius_that_does(monkeypatch):
    monkeypatch.setattr("planner.surface.poisson_disk._LIMIT", 50_000)
    house = house_on_ground()
    scene = scene_of(sample_mesh(house, 0.5, 0), house)
    with pytest.raises(PlannerError, match=r"house: .* set scale\.radius to at least") as refused:
        reconstruct_surface(scene, radius=0.1, poisson_depth=6)
    least = float(str(refused.value).split()[-2])
    assert len(reconstruct_surface(scene, radius=least, poisson_depth=6).samples) > 100
