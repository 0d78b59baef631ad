"""Preset ``smith``: its parts against brute force, and what it keeps to as a whole."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.config import ViewpointSettings
from planner.scene.cloud import Mesh
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.crowd import far_apart
from planner.viewpoints.eye import Album, Eye
from planner.viewpoints.free_balls import FreeBalls, free_balls
from planner.viewpoints.frustum import in_frustum
from planner.viewpoints.move_kernels import own_share, tally
from planner.viewpoints.moves import Moves, Wish, _look
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, parallax_weight, reconstructability
from planner.viewpoints.sight import SightRule
from planner.viewpoints.simplex import climb
from planner.viewpoints.smith import regular_places, smith_viewpoints, wanted_views
from planner.viewpoints.viewpoints import Viewpoints
from solvers.pairs import chord_table

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
BLOCK = np.array([[-6.0, -5.0, 0.0], [6.0, 5.0, 9.0]])
REFERENCE = 40.0


def mesh():
    """A block on a ground of 60 m."""
    x, y, z = BLOCK.T
    corners = np.array([[x[i], y[j], z[k]] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
    faces = [[0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5], [4, 5, 7, 6]]
    ground = np.array([[-30, -30, 0], [30, -30, 0], [30, 30, 0], [-30, 30, 0]], dtype=float)
    triangles = [[f[0], f[1], f[2]] for f in faces] + [[f[0], f[2], f[3]] for f in faces]
    return Mesh(np.vstack([corners, ground]), [*triangles, [8, 9, 10], [8, 10, 11]])


def samples():
    """Roof and the two long facades."""
    x, y, z = np.arange(-5.0, 5.1, 2.0), np.arange(-4.0, 4.1, 2.0), np.arange(1.0, 8.1, 2.0)
    roof = np.stack(np.meshgrid(x, y, [9.0]), -1).reshape(-1, 3)
    parts = [(roof, (0.0, 0.0, 1.0))]
    for side in (-1.0, 1.0):
        wall = np.stack(np.meshgrid(x, [5.0 * side], z), -1).reshape(-1, 3)
        parts.append((wall, (0.0, side, 0.0)))
    xyz = np.concatenate([points for points, _ in parts])
    normals = np.concatenate([np.tile(normal, (len(points), 1)) for points, normal in parts])
    return SurfaceSamples(xyz, normals, np.zeros(len(xyz)), 2.0)


def positions():
    axis = np.arange(-18.0, 18.1, 4.0)
    grid = np.stack(np.meshgrid(axis, axis, [4.0, 8.0, 12.0, 16.0, 20.0]), -1).reshape(-1, 3)
    away = np.maximum(np.maximum(BLOCK[0] - grid, grid - BLOCK[1]), 0.0)
    return grid[np.linalg.norm(away, axis=1) >= 3.0]


SAMPLES, POSITIONS, CASTER = samples(), positions(), RayCaster(mesh())
EYE = Eye(SAMPLES, CASTER, SightRule(0.0, REFERENCE, GRAZING, sectors=1), REFERENCE)
TABLE = chord_table(parallax_weight)
LIMITS = Wish(np.full(len(SAMPLES), 4.0), np.zeros(len(SAMPLES), dtype=np.int64)).limits(REFERENCE)


def place(airspace=None, spread=map, **changes):
    given = {"views": 10, "rounds": 2, **changes}
    return smith_viewpoints(
        *(POSITIONS, SAMPLES, CASTER, CAMERA),
        reference=REFERENCE,
        settings=ViewpointSettings(preset="smith", **given),
        map=spread,
        airspace=airspace,
    )


def worth(views, target=4.0):
    h = reconstructability(views, SAMPLES, CASTER, CAMERA, reference=REFERENCE)
    return np.minimum(h, target).sum()


def album(views):
    seen = EYE.see(views.positions)
    turn, tilt = views.yaw_deg[seen.owner], views.pitch_deg[seen.owner]
    return Album.of(seen.rows(in_frustum(-seen.sight[:, :3], turn, tilt, CAMERA)), len(SAMPLES))


@pytest.fixture(scope="module")
def views():
    return place()


def test_sums_are_those_of_the_exact_formula_by_fresh_rays(views):
    got = album(views)
    exact = reconstructability(views, SAMPLES, CASTER, CAMERA, reference=REFERENCE)
    value, sharp = np.zeros(len(SAMPLES)), np.zeros(len(SAMPLES), dtype=np.int64)
    tally(np.arange(len(SAMPLES)), got.starts, got.sight, TABLE, LIMITS, value, sharp)
    np.testing.assert_allclose(value, exact, atol=2e-4)
    np.testing.assert_array_equal(sharp, np.diff(got.starts))


def test_the_share_of_a_view_is_what_is_lost_without_it(views):
    got = album(views)
    for view in (0, 4, 9):
        left = views.take(np.delete(np.arange(len(views)), view))
        exact = [
            reconstructability(some, SAMPLES, CASTER, CAMERA, reference=REFERENCE)
            for some in (views, left)
        ]
        own = np.repeat(np.arange(len(SAMPLES)), np.diff(got.starts))[got.owner == view]
        known = (got.starts, got.owner, got.sight, TABLE, LIMITS)
        share, sharp = np.zeros(len(SAMPLES)), np.ones(len(own))
        share[own], got_sharp = own_share(view, own, *known)
        np.testing.assert_array_equal(got_sharp, sharp)
        np.testing.assert_allclose(share, exact[0] - exact[1], atol=2e-4)


def test_what_a_move_promises_is_what_it_gives(views):
    """The search's value of a pose equals brute force with the view moved there."""
    jobs = []
    place(spread=lambda run, parts: jobs.extend(parts) or map(run, parts), rounds=1)
    job = jobs[0]
    others = place(rounds=1, spread=stay)
    at = np.array([[-9.0, 3.0, 14.0], [12.0, -9.0, 6.0]])
    aims, values = _look(job, at, np.zeros(2, dtype=np.int64))
    view = job.views[0]
    rest = others.take(np.delete(np.arange(len(others)), view))
    for spot, aim, value in zip(at, aims, values, strict=True):
        yaw, pitch = _aim(aim)
        moved = rest.joined(Viewpoints(spot[None], [yaw], [pitch], ("smith",), [-1]))
        assert value == pytest.approx(worth(moved) - worth(rest), abs=0.02)


def _aim(row):
    from planner.viewpoints.candidates import aim_directions

    yaw, pitch = aim_directions(ViewpointSettings().aim_directions, CAMERA)
    return yaw[row], pitch[row]


def stay(_run, jobs):
    """Instead of ``map``: nothing moves."""
    return [Moves(job.views[:0], job.places[:0], job.views[:0]) for job in jobs]


def test_each_round_makes_it_better_and_the_number_is_kept(views):
    still = place(spread=stay)
    one = place(rounds=1)
    assert len(still) == len(one) == len(views) == 10
    assert worth(still) < worth(one) < worth(views)
    assert set(views.kind) == {"smith"}


def test_photos_without_an_airspace_stay_on_the_positions_and_aim_at_what_they_show(views):
    gaps = np.linalg.norm(views.positions[:, None] - POSITIONS[None], axis=2).min(axis=1)
    assert gaps.max() == 0.0
    aimed = views.take(np.flatnonzero(views.targets >= 0))
    rays = SAMPLES.xyz[aimed.targets] - aimed.positions
    assert len(aimed) > 5
    assert in_frustum(rays, aimed.yaw_deg, aimed.pitch_deg, CAMERA).all()


def test_with_an_airspace_photos_go_between_the_positions_and_stay_free(solids):
    space = solids([BLOCK], ground=0.0, d_min=3.0, bounds=((-20, -20, 0), (20, 20, 24)))
    got = place(space)
    assert space.is_free(got.positions).all()
    gaps = np.linalg.norm(got.positions[:, None] - POSITIONS[None], axis=2).min(axis=1)
    assert np.mean(gaps > 0.01) > 0.5
    assert worth(got) > worth(place(space, stay))


def backwards(function, jobs):
    """Like a pool of processes with its own order: arguments and results are pickled."""
    done = [
        pickle.dumps(function(pickle.loads(pickle.dumps(job))))  # noqa: S301
        for job in reversed(list(jobs))
    ]
    return [pickle.loads(part) for part in reversed(done)]  # noqa: S301


def test_workers_and_their_order_do_not_change_the_photos(views):
    again = place(spread=backwards)
    for name in ("positions", "yaw_deg", "pitch_deg", "targets"):
        np.testing.assert_array_equal(getattr(again, name), getattr(views, name))


def test_nowhere_to_fly_and_nothing_to_see_need_no_photos():
    empty = SurfaceSamples(np.empty((0, 3)), np.empty((0, 3)), np.empty(0), 1.0)
    for at, what in ((POSITIONS[:0], SAMPLES), (POSITIONS, empty)):
        got = smith_viewpoints(
            *(at, what, CASTER, CAMERA), reference=REFERENCE, settings=ViewpointSettings()
        )
        assert len(got) == 0


def test_the_number_of_photos_follows_the_area():
    assert wanted_views(SAMPLES, 10.0) == pytest.approx(4 * wanted_views(SAMPLES, 20.0), abs=2)


@given(st.integers(0, 10_000), st.integers(1, 60), st.floats(0.5, 30.0))
@settings(max_examples=40, deadline=None)
def test_groups_are_far_apart_and_hold_each_place_once(seed, count, distance):
    places = np.random.default_rng(seed).uniform(-20, 20, (count, 3))
    groups = list(far_apart(places, distance))
    assert sorted(np.concatenate(groups)) == list(range(count))
    for group in groups:
        gaps = np.linalg.norm(places[group][:, None] - places[group][None], axis=2)
        assert (gaps[~np.eye(len(group), dtype=bool)] >= distance).all()


def walk(search, height):
    """Answer a search until it ends."""
    points = next(search)
    while True:
        try:
            points = search.send((points, height(points)))
        except StopIteration as done:
            return done.value


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_the_simplex_climbs_to_the_top_of_a_hill(seed):
    rng = np.random.default_rng(seed)
    top, slope = rng.uniform(-3, 3, 3), rng.uniform(0.5, 2.0, 3)
    best, value = walk(
        climb(np.zeros(3), size=1.0, evaluations=200),
        lambda points: -(slope * (points - top) ** 2).sum(axis=1),
    )
    np.testing.assert_allclose(best, top, atol=0.05)
    assert value == pytest.approx(-(slope * (best - top) ** 2).sum())


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_whatever_is_moved_into_the_balls_is_free(solids, seed):
    space = solids([BLOCK], ground=0.0, d_min=3.0, ceiling=22.0)
    points = np.random.default_rng(seed).uniform((-25, -25, -5), (25, 25, 30), (200, 3))
    balls = free_balls(POSITIONS, space, margin=0.002)
    moved = balls.nearest(points)
    assert space.is_free(moved).all()
    np.testing.assert_allclose(balls.nearest(moved), moved, atol=4.1)


def test_a_point_in_its_ball_stays_where_it_is():
    balls = FreeBalls(np.array([[0.0, 0.0, 10.0], [9.0, 0.0, 10.0]]), np.array([2.0, 0.0]))
    points = np.array([[1.0, 1.0, 10.0], [0.0, 0.0, 15.0], [8.0, 3.0, 11.0]])
    expected = np.array([[1.0, 1.0, 10.0], [0.0, 0.0, 12.0], [9.0, 0.0, 10.0]])
    np.testing.assert_allclose(balls.nearest(points), expected)


def test_the_start_is_a_level_lattice_above_the_scene():
    anywhere = FreeBalls(np.zeros((1, 3)), np.array([1e6]))
    got = regular_places(SAMPLES.xyz, anywhere, 23, reference=REFERENCE)
    assert len(np.unique(got, axis=0)) == 23
    assert (got[:, 2] <= 9.0 + 0.4 * REFERENCE + 1e-9).all()
    assert (got[:, 2] >= 1.0 + 0.4 * REFERENCE).all()
