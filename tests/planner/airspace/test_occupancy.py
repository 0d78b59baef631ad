"""The flood: no sky cell holds a surface, and all the sky there is is found."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.airspace.occupancy import occupancy
from planner.airspace.terrain import terrain
from planner.airspace.voxel_kernels import DOWN, SHELL, UP, mark_triangles
from planner.scene.cloud import Mesh

seeds = st.integers(0, 2**31)


def grid_of(make, mesh, *, points=(), d_min=2.0, under_roofs=False, most_cells=2_000_000):
    scene = make.scene(points)
    return occupancy(
        mesh,
        terrain(scene.ground),
        scene.cloud.xyz,
        d_min=d_min,
        under_roofs=under_roofs,
        most_cells=most_cells,
    )


def on_triangles(rng, mesh, count):
    corners = mesh.vertices[mesh.triangles[rng.integers(0, len(mesh), count)]]
    return (rng.dirichlet(np.full(3, 0.5), count)[:, :, None] * corners).sum(axis=1)


@settings(max_examples=25, deadline=None)
@given(seeds, st.floats(0.3, 3.0))
def test_exactly_the_cells_that_triangles_touch_are_marked(seed, size):
    """Samples find most of the cells; the box of each triangle bounds them from outside."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 13, (6, 1, 3)) + rng.normal(0, size, (6, 3, 3))
    corners[0] = np.round(corners[0])  # along cell borders
    mesh = Mesh(corners.reshape(-1, 3), np.arange(18).reshape(-1, 3))
    flags = np.zeros((12, 12, 12), np.uint8)
    mark_triangles(flags, corners)
    marked = flags & SHELL > 0
    at = np.floor(on_triangles(rng, mesh, 20_000)).astype(int)
    at = at[((at >= 0) & (at < 12)).all(axis=1)]
    assert marked[tuple(at.T)].all()
    centres = np.argwhere(marked) + 0.5
    away = np.maximum(
        corners.min(axis=1) - centres[:, None], centres[:, None] - corners.max(axis=1)
    )
    assert (away.max(axis=2).min(axis=1) <= 0.5 + 1e-5).all()


@settings(max_examples=25, deadline=None)
@given(seeds)
def test_marked_cells_are_within_half_a_diagonal_of_a_triangle(brute, seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(2, 10, (4, 1, 3)) + rng.normal(0, 3, (4, 3, 3))
    flags = np.zeros((12, 12, 12), np.uint8)
    mark_triangles(flags, corners)
    centres = np.argwhere(flags & SHELL > 0) + 0.5
    assert (brute.points(centres, corners) <= 0.5 * np.sqrt(3) + 1e-5).all()
    crossed = np.argwhere(flags & (UP | DOWN) > 0)
    assert (flags[tuple(crossed.T)] & SHELL > 0).all()


def test_a_column_is_crossed_up_and_down_by_a_slab(make):
    flags = np.zeros((6, 6, 8), np.uint8)
    slab = make.boxes([((1, 1, 2.5), (5, 5, 5.5))])
    mark_triangles(flags, slab.vertices[slab.triangles])
    assert (flags[2:4, 2:4, 5] & UP > 0).all()
    assert (flags[2:4, 2:4, 2] & DOWN > 0).all()
    assert (flags[2:4, 2:4, [0, 1, 3, 4, 6, 7]] == 0).all()


@settings(max_examples=15, deadline=None)
@given(seeds, st.booleans())
def test_no_surface_and_no_point_is_in_the_sky(make, seed, under_roofs):
    rng = np.random.default_rng(seed)
    mesh = make.soup(seed)
    points = rng.uniform((-15, -15, 0), (15, 15, 20), (50, 3))
    grid, curtains = grid_of(make, mesh, points=points, under_roofs=under_roofs)
    for inside in (points, on_triangles(rng, mesh, 3000)):
        assert not grid.is_sky(inside)[0].any()
    if len(curtains):
        corners = curtains.vertices[curtains.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.abs(normals[:, 2]) < 1e-9).all()
        assert not grid.is_sky(on_triangles(rng, curtains, 2000))[0].any()


@settings(max_examples=15, deadline=None)
@given(seeds)
def test_whatever_is_clear_and_reached_in_the_open_is_sky(make, brute, seed):
    """Straight up from a sky place, all that keeps ``d_min`` to surfaces is sky."""
    rng = np.random.default_rng(seed)
    mesh = make.soup(seed, 25)
    grid, _ = grid_of(make, mesh)
    columns = np.column_stack([rng.uniform(-18, 18, (60, 2)), np.zeros(60)])
    corners = mesh.vertices[mesh.triangles]
    for column in columns:
        heights = np.arange(30.0, 2.0, -0.2)
        up = column + heights[:, None] * [0, 0, 1]
        blocked = brute.points(up, corners) < 2.0
        reached = up[: int(np.argmax(blocked))] if blocked.any() else up
        sky, within = grid.is_sky(reached)
        assert (sky | ~within).all()


def test_mask_and_bits_agree(make):
    grid, _ = grid_of(make, make.boxes([((-5, -5, 0), (5, 5, 9))]))
    mask = grid.mask()
    index = np.argwhere(np.ones(mask.shape, bool))
    sky, within = grid.is_sky(grid.origin + (index + 0.5) * grid.cell)
    np.testing.assert_array_equal(sky, mask.ravel())
    assert within.all()
    assert 0.3 < mask.mean() < 0.9
    np.testing.assert_allclose(
        grid.centres(2)[:2], grid.origin[2] + grid.cell * np.array([0.5, 1.5])
    )


def test_cells_are_a_quarter_of_d_min_unless_that_takes_too_much_memory(make):
    mesh = make.boxes([((-5, -5, 0), (5, 5, 9))])
    fine, coarse = (grid_of(make, mesh, most_cells=most)[0] for most in (2_000_000, 20_000))
    assert fine.cell == 0.5
    assert fine.reach == 1
    assert coarse.cell > 0.5
    assert np.prod(coarse.shape) <= 20_000
    assert coarse.blur <= 2.0 or coarse.reach == 0
