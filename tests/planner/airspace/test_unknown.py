"""Space that was never seen: funnels over scanned ground, hollows, and every query alike."""

import io
from dataclasses import replace

import numpy as np
import pytest

from planner.airspace.airspace import Airspace, build_airspace
from planner.airspace.candidates import candidate_positions
from planner.airspace.field import DistanceField
from planner.airspace.solids import looked_within
from planner.airspace.unknown import _faces
from planner.config import AirspaceSettings
from planner.scene.images import Images
from planner.scene.synthetic import scene_of, synthetic_block

D_MIN = 2.0
CELL = 0.5 * D_MIN
CLOSED = AirspaceSettings(unknown="closed", fill_under_roofs=False)
OPEN = AirspaceSettings(fill_under_roofs=False)


def lattice(low, high, step, z=0.05):
    """Points on a level rectangle."""
    x, y = (np.arange(a, b, step) for a, b in zip(low, high, strict=True))
    at = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.column_stack([at, np.full(len(at), z)])


def build(make, mesh, points, settings):
    scene = make.scene(points, half=30.0)
    return build_airspace(scene, mesh, d_min=D_MIN, d_max=12.0, settings=settings)


def nothing(make):
    return make.sheet((-1, -1), (1, 1), -1.0)  # under the ground


@pytest.mark.parametrize("widest", [60.0, 30.0])
def test_level_ground_is_seen_in_a_funnel_as_wide_as_the_first_flight_looked(make, widest):
    settings = CLOSED.model_copy(update={"seen_within_deg": widest})
    ground = lattice((-8, -8), (8, 8), 0.5)
    space = build(make, nothing(make), ground, settings)
    slope = np.tan(np.radians(widest))
    heights = np.linspace(3.0, 26.0, 40)
    slack = 2.0 * CELL
    for way in ([1, 0], [0, -1], [-1, 0]):
        beside = 8.0 + slope * heights
        kept = beside < 38.0
        far = np.column_stack([np.outer(beside + slack, way), heights])[kept]
        assert (space.clearance(far) < D_MIN).all()
        inner = beside - slack - D_MIN / np.cos(np.radians(widest))
        near = np.column_stack([np.outer(inner, way), heights])[kept & (inner > 0.0)]
        assert len(near) > 10
        assert space.is_free(near).all()
    assert build(make, nothing(make), ground, OPEN).is_free(far).all()


def test_without_any_data_all_is_unknown(make):
    space = build(make, nothing(make), np.zeros((0, 3)), CLOSED)
    rng = np.random.default_rng(0)
    inside = rng.uniform(space.low + 0.01, space.high - 0.01, (300, 3))
    assert (space.clearance(inside) < 0.0).all()


def test_a_hole_in_the_data_is_known_as_far_as_lines_beside_it_reach(make):
    ground = lattice((-28, -28), (28, 28), 0.5)
    ground = ground[np.abs(ground[:, :2]).max(axis=1) > 8.0]
    space = build(make, nothing(make), ground, CLOSED)
    reach = 8.0 / np.tan(np.radians(60.0))
    low = np.array([[0.0, 0.0, reach - 2.0 * CELL], [0.0, 0.0, 1.0]])
    assert (space.clearance(low) < D_MIN).all()
    assert space.is_free(np.array([[0.0, 0.0, reach + 2.0 * CELL + 2.0 * D_MIN]])).all()


def test_a_low_wide_table_hides_what_is_under_its_middle_only(make):
    points = np.vstack([lattice((-28, -28), (28, 28), 0.5), lattice((-12, -12), (12, 12), 0.5, 7)])
    table = make.boxes([((-12, -12, 6.5), (12, 12, 7.0))])
    under, beside = np.array([[0.0, 0.0, 3.2]]), np.array([[15.0, 0.0, 3.2]])
    opened, closed = (build(make, table, points, settings) for settings in (OPEN, CLOSED))
    assert opened.is_free(under).all()
    assert opened.is_free(beside).all()
    assert closed.clearance(under)[0] < 0.0
    assert closed.is_free(beside).all()
    end = np.array([25.0, 0.0, 3.2])
    assert opened.edge_is_free(end, under[0])
    assert not closed.edge_is_free(end, under[0])
    assert not closed.capsule_clearance_at_least(end, under[0], D_MIN)


def test_a_stray_point_blocks_sight_and_proves_nothing(make):
    scene = make.scene(np.zeros((0, 3)), half=30.0)
    scene = replace(scene, strays=lattice((-8, -8), (8, 8), 0.5))
    space = build_airspace(scene, nothing(make), d_min=D_MIN, d_max=12.0, settings=CLOSED)
    assert space.clearance(np.array([[0.0, 0.0, 8.0]]))[0] < 0.0


@pytest.fixture(scope="module")
def block():
    return synthetic_block(4, size=(44.0, 44.0), buildings=3, spacing=0.7)


@pytest.fixture(scope="module")
def spaces(block):
    """The same block with the unknown open and closed."""
    scene = scene_of(block)
    lengths = {"d_min": D_MIN, "d_max": 12.0}
    return [
        build_airspace(scene, block.mesh, **lengths, settings=AirspaceSettings(unknown=unknown))
        for unknown in ("open", "closed")
    ]


def test_closing_only_takes_away_and_keeps_nearly_all_over_the_scanned_place(spaces, block):
    opened, closed = spaces
    spots = np.random.default_rng(1).uniform(*closed.bounds, (4000, 3))
    before, after = opened.clearance(spots), closed.clearance(spots)
    assert (after <= np.maximum(before, 0.0) + 1e-9).all()
    assert (after >= D_MIN).mean() < 0.95 * (before >= D_MIN).mean()
    over = scene_of(block).box.contains(spots) & (before >= D_MIN)
    assert (after[over] >= D_MIN).mean() > 0.97


def test_every_free_place_lies_in_a_cell_that_some_true_line_of_sight_passes(spaces, block):
    """By exact rays against the true triangles, in directions of their own."""
    import open3d as o3d
    from scipy.spatial import KDTree

    closed, rng = spaces[1], np.random.default_rng(2)
    spots = rng.uniform(*closed.bounds, (3000, 3))
    spots = spots[closed.is_free(spots)][:400]
    cells = closed.low + (np.floor((spots - closed.low) / CELL) + 0.5) * CELL
    tilt, turn = np.radians(rng.uniform(0, 62, 160)), rng.uniform(0, 2 * np.pi, 160)
    ways = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)]).T
    ways = np.vstack([ways, [0.0, 0.0, 1.0]])
    rays = o3d.t.geometry.RaycastingScene(nthreads=1)
    rays.add_triangles(
        block.mesh.vertices.astype(np.float32), block.mesh.triangles.astype(np.uint32)
    )
    tree, seen = KDTree(block.cloud.xyz), np.zeros(len(cells), bool)
    for _ in range(4):  # lines through grids of cells wobble by half a cell
        start = cells + rng.uniform(-0.5 * CELL, 0.5 * CELL, cells.shape)
        both = np.stack([ways, -ways])
        shape = (2, len(start), len(ways), 3)
        lines = np.concatenate(
            [
                np.broadcast_to(start[None, :, None], shape),
                np.broadcast_to(both[:, None], shape),
            ],
            axis=-1,
        ).astype(np.float32)
        up, down = rays.cast_rays(o3d.core.Tensor(lines), nthreads=1)["t_hit"].numpy()
        end = start[:, None] - np.where(np.isinf(down), 0.0, down)[..., None] * ways
        near = tree.query(end)[0] <= 3.0 * CELL
        seen |= (np.isinf(up) & np.isfinite(down) & near).any(axis=1)
    assert len(seen) == 400
    assert seen.all()


def test_the_second_opinion_and_the_stored_airspace_know_of_it_too(spaces):
    opened, closed = spaces
    stream = io.BytesIO()
    np.savez(stream, **closed.to_arrays())
    stream.seek(0)
    arrays = np.load(stream, allow_pickle=False)
    again, second = Airspace.from_arrays(arrays), DistanceField.from_arrays(arrays)
    spots = np.random.default_rng(3).uniform(*closed.bounds, (3000, 3))
    here = closed.clearance(spots)
    np.testing.assert_array_equal(again.clearance(spots), here)
    lost = (opened.clearance(spots) >= D_MIN) & (here < D_MIN)
    assert lost.sum() > 100
    assert (second.clearance(spots[lost]) < D_MIN).all()
    deep = here < -0.1
    assert (second.clearance(spots[deep]) < 0.0).all()
    np.testing.assert_array_equal(
        closed.clearance_range(spots[deep])[0] < D_MIN, np.ones(deep.sum(), bool)
    )


def test_no_candidate_is_in_the_unknown(spaces, block):
    closed = spaces[1]
    box = scene_of(block).box
    places = candidate_positions(closed, box=box, voxel=3.0, limit=5000).positions
    assert len(places) > 50
    assert (closed.clearance(places) >= D_MIN).all()
    others = candidate_positions(spaces[0], box=box, voxel=3.0, limit=5000).positions
    assert len(places) < len(others)


def test_cells_wider_than_a_surface_is_thick_close_the_surface_too(make, monkeypatch):
    from planner.airspace import unknown

    monkeypatch.setattr(unknown, "_MOST_CELLS", 3_000)
    ground = lattice((-28, -28), (28, 28), 0.5)
    space = build(make, nothing(make), ground, CLOSED)
    spots = np.random.default_rng(0).uniform((-20, -20, 0), (20, 20, 30), (2000, 3))
    assert space.is_free(spots).any()
    assert (space.clearance(spots) <= spots[:, 2] + 1e-6).all()


def photos(pitch_deg, optics):
    count = len(pitch_deg)
    names = tuple(map(str, range(count)))
    return Images(
        np.zeros((count, 3)), np.zeros(count), np.array(pitch_deg, float), names, np.array(optics)
    )


def test_photos_tell_how_far_the_first_flight_looked(make):
    nadir = [[2.0 * np.sqrt(2.0), 2.0 * np.sqrt(2.0), 2.0]] * 3  # 45 degrees to the corner
    assert looked_within(None) == looked_within(photos([], np.zeros((0, 3)))) == 60.0
    assert looked_within(photos([-90, -90, 0], nadir)) == pytest.approx(45.0)
    assert looked_within(photos([-80, -80, -80], nadir)) == pytest.approx(55.0)
    assert looked_within(photos([-30, -30, -30], nadir)) == 75.0
    assert looked_within(photos([-90], [[np.nan] * 3])) == 42.0
    ground = lattice((-8, -8), (8, 8), 0.5)
    scene = make.scene(ground, half=30.0)
    high = np.array([[26.0, 0.0, 22.0]])  # 18 m beside the scanned ground: 39 degrees
    for known, seen in ((photos([-90], [[0.6, 0.8, 1.0]]), False), (None, True)):
        place = replace(scene, images=known)
        settings = CLOSED.model_copy(update={"seen_within_deg": None})
        space = build_airspace(place, nothing(make), d_min=D_MIN, d_max=12.0, settings=settings)
        assert space.is_free(high)[0] == seen


def test_faces_close_each_set_of_cells_outward():
    import trimesh

    rng = np.random.default_rng(0)
    for cells in (np.ones((2, 3, 4), bool), rng.random((5, 6, 7)) < 0.4):
        vertices, triangles = _faces(cells)
        mesh = trimesh.Trimesh(vertices, triangles, process=False)
        assert mesh.volume == pytest.approx(cells.sum())
        padded = np.pad(cells, 1).astype(int)
        sides = sum(np.abs(np.diff(padded, axis=axis)).sum() for axis in range(3))
        assert mesh.area == pytest.approx(sides)
        np.testing.assert_allclose(mesh.area_faces @ mesh.face_normals, 0.0, atol=1e-9)
