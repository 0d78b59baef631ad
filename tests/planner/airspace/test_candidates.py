"""Candidate positions against asking every voxel, one by one."""

import numpy as np
import pytest

from planner.airspace.airspace import build_airspace
from planner.airspace.candidates import candidate_positions
from planner.config import AirspaceSettings, ZoneSettings

BLOCKS = [((-14, -14, 0), (-6, -6, 12)), ((4, -12, 0), (12, -2, 7)), ((2, 6, 9), (16, 10, 10))]


@pytest.fixture(scope="module")
def place(make):
    points = np.random.default_rng(0).uniform((-18, -18, 0), (10, 18, 14), (25, 3))
    scene = make.scene(points, turn=0.3)
    zone = ZoneSettings(polygon=((-30, 5), (-10, 5), (-10, 20), (-30, 20)))
    limits = AirspaceSettings(zones=(zone,), ceiling=22.0)
    mesh = make.boxes(BLOCKS)
    return scene, build_airspace(scene, mesh, d_min=2.0, d_max=9.0, settings=limits)


def all_voxels(scene, airspace, voxel):
    shape = np.floor((scene.box.size + 2 * airspace.d_max) / voxel).astype(int)
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3)
    return scene.box.centre + ((index + 0.5 - 0.5 * shape) * voxel) @ scene.box.axes


@pytest.mark.parametrize("voxel", [2.6, 7.0])
def test_exactly_the_free_voxel_centres_near_solids_are_found(place, voxel):
    scene, airspace = place
    grid = candidate_positions(airspace, box=scene.box, voxel=voxel, limit=10**6)
    every = all_voxels(scene, airspace, voxel)
    clearance = airspace.clearance(every)
    away = np.linalg.norm(every[:, None] - airspace.obstacles, axis=2).min(axis=1)
    usable = airspace.is_free(every) & (away <= airspace.d_max)
    barely = clearance < airspace.d_min + 0.01  # a hair more than d_min is asked for
    wanted = every[usable]
    assert grid.voxel == voxel
    assert len(wanted) - (usable & barely).sum() <= len(grid) <= len(wanted)
    rows = {tuple(row) for row in np.round(wanted, 9)}
    assert rows.issuperset(tuple(row) for row in np.round(grid.positions, 9))


@pytest.mark.parametrize("margin", [0.001, 0.3, 1.5])
def test_what_the_flight_keeps_is_kept_from_solids_and_zones(place, margin):
    scene, airspace = place
    grid, every = (
        candidate_positions(airspace, box=scene.box, voxel=1.3, limit=10**6, margin=kept).positions
        for kept in (margin, 0.0)
    )

    def spare(places):
        return np.minimum(airspace.clearance(places) - 2.0, airspace.zone_margin(places))

    assert spare(grid).min() > margin
    rows = {tuple(row) for row in grid}
    assert len(rows) > 1000
    assert rows.issuperset(tuple(row) for row in every[spare(every) > margin + 0.01])


def test_too_many_become_fewer_by_wider_voxels(place):
    scene, airspace = place
    many = candidate_positions(airspace, box=scene.box, voxel=1.0, limit=10**6)
    few = candidate_positions(airspace, box=scene.box, voxel=1.0, limit=800)
    assert len(many) > 5000
    assert 400 < len(few) <= 800
    assert few.voxel > 1.0
    assert airspace.is_free(few.positions).all()
    assert airspace.obstacle_distance(few.positions).max() <= airspace.d_max
    again = candidate_positions(airspace, box=scene.box, voxel=1.0, limit=800)
    np.testing.assert_array_equal(again.positions, few.positions)


def test_absurdly_small_voxels_take_neither_time_nor_memory(place):
    scene, airspace = place
    grid = candidate_positions(airspace, box=scene.box, voxel=1e-4, limit=300)
    assert 100 < len(grid) <= 300


def test_neighbours_are_a_voxel_apart_along_the_box(place):
    scene, airspace = place
    grid = candidate_positions(airspace, box=scene.box, voxel=3.0, limit=10**6)
    local = (grid.positions - scene.box.centre) @ scene.box.axes.T
    shape = np.floor((scene.box.size + 18.0) / 3.0)
    steps = local / 3.0 + 0.5 * shape - 0.5
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_without_points_solids_are_what_is_photographed(make):
    mesh = make.boxes(BLOCKS)
    airspace = build_airspace(make.scene(), mesh, d_min=2.0, d_max=9.0)
    grid = candidate_positions(airspace, box=make.scene().box, voxel=4.0, limit=10**5)
    assert len(grid) > 300
    assert airspace.clearance(grid.positions).max() <= 9.0


def test_no_room_gives_no_positions(place, make):
    scene, _ = place
    everywhere = ZoneSettings(polygon=((-99, -99), (99, -99), (99, 99), (-99, 99)))
    shut = build_airspace(
        scene,
        make.boxes(BLOCKS),
        d_min=2.0,
        d_max=9.0,
        settings=AirspaceSettings(zones=(everywhere,)),
    )
    assert candidate_positions(shut, box=scene.box, voxel=3.0, limit=100).positions.shape == (0, 3)


@pytest.mark.parametrize(("voxel", "limit"), [(0.0, 10), (-1.0, 10), (np.nan, 10), (1.0, 0)])
def test_nonsense_is_refused(place, voxel, limit):
    scene, airspace = place
    with pytest.raises(ValueError, match="positive"):
        candidate_positions(airspace, box=scene.box, voxel=voxel, limit=limit)
