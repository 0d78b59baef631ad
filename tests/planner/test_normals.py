"""Normals are right in axis and point out of the solid, whatever the file says."""

import numpy as np
import pytest

from planner.scene.cleaning import thin
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.ground import estimate_ground
from planner.scene.load import load_scene
from planner.scene.normals import estimate_normals, orient_samples
from planner.scene.openness import sky_grid
from planner.scene.sampling import cover_mesh, sample_mesh, triangle_normals


def cuboid(low, high):
    """Vertices and outward triangles of a box."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return low + unit * (high - low), np.array(
        [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    )


def plate(low, high):
    """Vertices and upward triangles of a rectangle at height zero."""
    (x0, y0), (x1, y1) = low, high
    vertices = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], dtype=float)
    return vertices, np.array([[0, 1, 2], [0, 2, 3]])


def joined(parts):
    vertices, triangles, count = [], [], 0
    for v, t in parts:
        vertices.append(v)
        triangles.append(t + count)
        count += len(v)
    return Mesh(np.concatenate(vertices), np.concatenate(triangles))


def street():
    """Two buildings, one on two pillars over a passage, on a ground plate; outward windings."""
    return joined(
        [
            plate([-10, -10], [70, 50]),
            cuboid([0, 0, 0], [20, 30, 18]),
            cuboid([32, 0, 6], [56, 30, 20]),
            cuboid([34, 2, 0], [37, 28, 6]),
            cuboid([51, 2, 0], [54, 28, 6]),
        ]
    )


def seen_from_outside(mesh, spacing):
    """Samples with true outward normals, without those in or under the solids."""
    truth = sample_mesh(mesh, spacing, 1)
    above = truth.xyz + 0.3 * truth.normals
    x, y, z = above.T
    buried = z < 0
    for (x0, y0, z0), (x1, y1, z1) in (
        ((0, 0, 0), (20, 30, 18)),
        ((32, 0, 6), (56, 30, 20)),
        ((34, 2, 0), (37, 28, 6)),
        ((51, 2, 0), (54, 28, 6)),
    ):
        buried |= (x > x0) & (x < x1) & (y > y0) & (y < y1) & (z > z0) & (z < z1)
    return truth.take(~buried)


@pytest.mark.parametrize("spacing", [0.5, 0.8])
def test_a_street_with_a_passage_gets_outward_normals(spacing):
    truth = thin(seen_from_outside(street(), 0.5 * spacing), spacing)
    ground = estimate_ground(truth.xyz, cell=1.0)
    cloud = estimate_normals(PointCloud(truth.xyz), 16, ground=ground)
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1.0, atol=1e-12)
    along = (cloud.normals * truth.normals).sum(axis=1)
    plane = np.abs(along) > 0.9  # not at an edge, where the plane is a blend of two
    assert plane.mean() > 0.75
    assert (along[plane] > 0).mean() > 0.99
    below = plane & (truth.normals[:, 2] < -0.5)  # the passage's ceiling
    assert below.sum() > 100
    assert (along[below] > 0).mean() > 0.85


def test_a_roof_and_scraps_of_facade_as_lidar_sees_them():
    """No closed solid at all: flat roofs, ground, and one point in thirty of the walls."""
    truth = seen_from_outside(street(), 0.5)
    keep = (truth.normals[:, 2] > 0.5) | (
        (np.abs(truth.normals[:, 2]) < 0.5) & (np.arange(len(truth)) % 30 == 0)
    )
    truth = truth.take(keep)
    ground = estimate_ground(truth.xyz, cell=1.0)
    cloud = estimate_normals(PointCloud(truth.xyz), 12, ground=ground)
    along = (cloud.normals * truth.normals).sum(axis=1)
    plane = np.abs(along) > 0.9
    assert (along[plane] > 0).mean() > 0.99
    walls = plane & (np.abs(truth.normals[:, 2]) < 0.5)
    assert walls.sum() > 100
    assert (along[walls] > 0).mean() > 0.97


def test_normals_do_not_depend_on_those_that_were_there():
    truth = seen_from_outside(street(), 0.8)
    flipped = PointCloud(truth.xyz, -truth.normals)
    np.testing.assert_array_equal(
        estimate_normals(flipped, 16).normals, estimate_normals(truth, 16).normals
    )


@pytest.mark.parametrize("seed", [0, 1])
def test_a_soup_of_any_winding_gives_outward_samples_and_none_inside(seed):
    mesh = street()
    rng = np.random.default_rng(seed)
    turn = rng.random(len(mesh)) < 0.5
    triangles = np.where(turn[:, None], mesh.triangles[:, ::-1], mesh.triangles)
    inner = cuboid([4, 4, 4], [16, 26, 14])  # a closed room that nobody sees
    soup = joined([(mesh.vertices, triangles), inner])
    cover = cover_mesh(soup, 0.4)
    ground = estimate_ground(cover, cell=1.0, low=0.0)
    samples = sample_mesh(soup, 0.6, seed)
    oriented = orient_samples(samples, soup, sky_grid(cover, 0.8, ground), ground)
    x, y, z = oriented.xyz.T
    assert not ((x > 3) & (x < 17) & (y > 3) & (y < 27) & (z > 2) & (z < 16)).any()
    truth, areas = triangle_normals(mesh)
    # each sample lies on one triangle of the street: the nearest plane that it is within
    best = np.full(len(oriented), np.inf)
    wanted = np.zeros((len(oriented), 3))
    for corners, normal in zip(mesh.vertices[mesh.triangles], truth, strict=True):
        off = np.abs((oriented.xyz - corners[0]) @ normal)
        low, high = corners.min(axis=0) - 1e-6, corners.max(axis=0) + 1e-6
        hit = ((oriented.xyz >= low) & (oriented.xyz <= high)).all(axis=1) & (off < best)
        best[hit], wanted[hit] = off[hit], normal
    assert best.max() < 1e-6
    assert ((oriented.normals * wanted).sum(axis=1) > 0.999).mean() > 0.99
    assert areas.sum() > 0


def test_too_few_points_are_a_programming_error():
    with pytest.raises(ValueError, match="three points"):
        estimate_normals(PointCloud(np.zeros((2, 3))), 16)
    mesh = Mesh(*plate([0, 0], [1, 1]))
    ground = estimate_ground(mesh.vertices, cell=1.0)
    with pytest.raises(ValueError, match="without normals"):
        orient_samples(PointCloud(np.zeros((5, 3))), mesh, sky_grid(mesh.vertices, 1.0), ground)


def test_coinciding_points_still_have_unit_normals():
    cloud = estimate_normals(PointCloud(np.ones((50, 3))), 8)
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1.0)


@pytest.mark.parametrize(
    ("file", "share"),
    [
        ("meshes/lyon_church_vaulx.ply", 0.99),
        ("meshes/rotterdam_block_220m.ply", 0.99),
        ("planner_scenes/sip_BigBen.stl", 0.99),
        ("citymodels/3dbag_tile901.city.jsonl", 0.99),
    ],
)
def test_real_models_whose_windings_are_outward_agree(shared_data, file, share):
    scene = load_scene(shared_data / "scenes" / file)
    corners = scene.mesh.vertices[scene.mesh.triangles]
    normals, areas = triangle_normals(scene.mesh)
    # the triangle of a sample: that whose plane and barycentric box hold it; checked on a share
    rows = np.flatnonzero(np.abs(scene.cloud.normals[:, 2]) < 0.5)
    rows = rows[:: max(1, len(rows) // 200)]
    agree = []
    for row in rows:
        point, normal = scene.cloud.xyz[row], scene.cloud.normals[row]
        a, b, c = np.moveaxis(corners, 1, 0)
        off = np.abs(((point - a) * normals).sum(axis=1))
        sides = [np.cross(q - p, point - p) @ np.eye(3) for p, q in ((a, b), (b, c), (c, a))]
        within = np.all([(side * normals).sum(axis=1) >= -1e-6 for side in sides], axis=0)
        faces = np.flatnonzero(within & (off < 1e-6) & (areas > 1e-6))
        if len(faces):
            agree.append((normals[faces] @ normal > 0.9).any())
    assert len(agree) > 50
    assert np.mean(agree) > share
