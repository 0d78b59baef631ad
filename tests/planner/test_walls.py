"""Walls stand where a roof ends and nobody saw the facade, and nowhere else."""

import numpy as np
import pytest

from planner.scene.cloud import PointCloud
from planner.scene.scene import Ground
from planner.surface.walls import roof_edges, stand_walls

RADIUS, SPACING = 2.0, 0.5
LEVEL = Ground(np.zeros((1, 1)), np.zeros(2), 1.0)


def level(low, high, height, up=1.0):
    x, y = (np.arange(low[k], high[k] + 1e-9, SPACING) for k in range(2))
    gx, gy = np.meshgrid(x, y, indexing="ij")
    xyz = np.column_stack([gx.ravel(), gy.ravel(), np.full(gx.size, height)])
    return PointCloud(xyz, np.tile([0.0, 0, up], (len(xyz), 1)))


def joined(*clouds):
    return PointCloud(
        np.vstack([cloud.xyz for cloud in clouds]), np.vstack([cloud.normals for cloud in clouds])
    )


def street():
    ground = level((-30, -30), (30, 30), 0.0)
    under = (np.abs(ground.xyz[:, 0]) <= 8.0) & (np.abs(ground.xyz[:, 1]) <= 6.0)
    return ground.take(~under)


ROOF = level((-8, -6), (8, 6), 10.0)


def turned(cloud, angle):
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    return PointCloud(cloud.xyz @ turn.T, cloud.normals @ turn.T)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4])
def test_four_walls_stand_under_a_flat_roof(angle):
    walls = turned(stand_walls(turned(joined(street(), ROOF), angle), LEVEL, radius=RADIUS), -angle)
    x, y, z = walls.xyz.T
    off = np.maximum(np.abs(x) - 8.0, np.abs(y) - 6.0)
    assert np.abs(off).max() < 0.5 * RADIUS
    assert z.min() > 0.0
    assert z.max() < 10.0
    wanted = 2 * (16 + 12) * 10 / (0.5 * RADIUS) ** 2
    assert 0.5 * wanted < len(walls) < 1.2 * wanted  # fewer on a diagonal of the grid
    np.testing.assert_allclose(np.linalg.norm(walls.normals, axis=1), 1.0)
    np.testing.assert_allclose(walls.normals[:, 2], 0.0)
    assert (np.einsum("nc,nc->n", walls.normals, walls.xyz * [1, 1, 0]) > 0.0).all()
    middle = (np.abs(y) < 3.0) & (x > 7.0)
    assert (walls.normals[middle, 0] > 0.95).all()


def test_a_measured_facade_gets_no_second_wall():
    facade = level((-6, 0.5), (6, 9.5), 0.0)
    xyz = facade.xyz[:, [2, 0, 1]] + [8.0, 0, 0]
    seen = PointCloud(xyz, np.tile([1.0, 0, 0], (len(xyz), 1)))
    walls = stand_walls(joined(street(), ROOF, seen), LEVEL, radius=RADIUS)
    assert walls.xyz[:, 0].max() < 8.0 - 0.5 * RADIUS + 1e-9


def test_what_was_seen_through_has_no_walls():
    deck = joined(level((-30, -30), (30, 30), 0.0), ROOF)
    assert len(stand_walls(deck, LEVEL, radius=RADIUS)) == 0


def test_a_measured_underside_means_no_walls():
    underside = level((-8, -6), (8, 6), 9.0, up=-1.0)
    assert len(stand_walls(joined(street(), ROOF, underside), LEVEL, radius=RADIUS)) == 0


def test_low_steps_slopes_and_poles_have_no_walls():
    kerb = joined(street(), level((-8, -6), (8, 6), 0.9 * RADIUS))
    assert len(roof_edges(kerb, LEVEL, radius=RADIUS).xyz) == 0
    plain = level((-30, -30), (30, 30), 0.0)
    slope = PointCloud(plain.xyz + np.outer(plain.xyz[:, 0], [0, 0, 1.0]), plain.normals)
    low = Ground(np.full((1, 1), -99.0), np.zeros(2), 1.0)
    inner = np.abs(roof_edges(slope, low, radius=RADIUS).xyz[:, :2]).max(axis=1, initial=0) < 28.0
    assert not inner.any()
    pole = PointCloud(np.array([[0, 0, 9.0], [0, 0, 8.5]]), np.tile([0.0, 0, 1], (2, 1)))
    assert len(stand_walls(joined(plain, pole), LEVEL, radius=RADIUS)) == 0


def test_a_setback_stands_on_the_terrace_below_it():
    tower = level((-3, -3), (3, 3), 25.0)
    terrace = ROOF.take((np.abs(ROOF.xyz[:, :2]) > 3.0).any(axis=1))
    walls = stand_walls(joined(street(), terrace, tower), LEVEL, radius=RADIUS)
    inner = np.abs(walls.xyz[:, :2]).max(axis=1) < 4.0
    assert inner.any()
    assert walls.xyz[inner, 2].min() > 10.0
    assert walls.xyz[inner, 2].max() > 23.0


def test_without_points_before_the_edge_the_wall_ends_on_the_ground():
    edges = roof_edges(ROOF, Ground(np.full((1, 1), 3.0), np.zeros(2), 1.0), radius=RADIUS)
    assert len(edges.xyz) > 0
    np.testing.assert_array_equal(edges.foot, 3.0)
