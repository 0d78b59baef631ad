"""What places and viewpoints see, on geometry that can be worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.config import ViewpointSettings
from planner.scene.cloud import Mesh
from planner.surface.samples import SurfaceSamples
from planner.viewpoints import pairs as pairs_module
from planner.viewpoints.camera import Camera
from planner.viewpoints.frustum import in_frustum
from planner.viewpoints.pairs import Aims, visible_pairs
from planner.viewpoints.pool import Pool
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import coverage

RULE = SightRule(d_min=2.0, d_max=30.0, max_incidence=math.radians(70.0))
UP = (0.0, 0.0, 1.0)
NORTH = (0.0, 1.0, 0.0)
SOUTH = (0.0, -1.0, 0.0)


def quad(corner, one, other):
    """Rectangle of two triangles."""
    a, u, v = (np.array(x, dtype=float) for x in (corner, one, other))
    return np.array([a, a + u, a + u + v, a + v]), np.array([[0, 1, 2], [0, 2, 3]])


def mesh_of(*quads):
    vertices = [v for v, _ in quads]
    triangles = [t + 4 * number for number, (_, t) in enumerate(quads)]
    return Mesh(np.concatenate(vertices), np.concatenate(triangles))


def samples_of(*pairs, radius=0.5):
    xyz, normals = (np.array(column, dtype=float) for column in zip(*pairs, strict=True))
    return SurfaceSamples(xyz, normals, np.zeros(len(xyz)), radius)


GROUND = quad((-50, -50, 0), (100, 0, 0), (0, 100, 0))
WALL = quad((-10, 0, 0), (20, 0, 0), (0, 0, 10))  # in the plane y = 0
NOTHING = Mesh(np.empty((0, 3)), np.empty((0, 3)))


def seen(positions, samples, mesh, rule=RULE):
    """Matrix of who sees whom."""
    positions = np.array(positions, dtype=float)
    pairs = visible_pairs(positions, samples, RayCaster(mesh), rule)
    matrix = np.zeros((len(positions), len(samples)), dtype=bool)
    matrix[pairs.position, pairs.sample] = True
    return matrix


def test_a_wall_hides_what_lies_behind_it():
    before, behind = ((0, -5, 0), UP), ((0, 5, 0), UP)
    got = seen([(0, -10, 5), (0, 10, 5)], samples_of(before, behind), mesh_of(GROUND, WALL))
    np.testing.assert_array_equal(got, [[True, False], [False, True]])


def test_over_the_wall_the_ray_passes_exactly_where_geometry_says():
    # From (0, -10, z) to (0, 5, 0) the line crosses y = 0 at z / 3: free above 10 / (1/3) = 30.
    rule = SightRule(d_min=2.0, d_max=100.0, max_incidence=math.radians(70.0))
    got = seen(
        [(0, -10, 29.4), (0, -10, 30.6)], samples_of(((0, 5, 0), UP)), mesh_of(GROUND, WALL), rule
    )
    np.testing.assert_array_equal(got[:, 0], [False, True])


def test_each_side_of_a_wall_is_seen_from_its_own_side():
    sides = samples_of(((0, 0, 5), SOUTH), ((0, 0, 5), NORTH))
    got = seen([(0, -8, 6), (0, 8, 6)], sides, mesh_of(GROUND, WALL))
    np.testing.assert_array_equal(got, [[True, False], [False, True]])


def test_nothing_is_seen_from_below():
    assert not seen([(0, 0, -8)], samples_of(((0, 0, 0), UP)), mesh_of(GROUND)).any()


@pytest.mark.parametrize(("tilt", "visible"), [(0, True), (69.9, True), (70.1, False)])
def test_incidence_ends_at_its_limit(tilt, visible):
    position = 10 * np.array([math.sin(math.radians(tilt)), 0, math.cos(math.radians(tilt))])
    assert seen([position], samples_of(((0, 0, 0), UP)), mesh_of(GROUND))[0, 0] == visible


@pytest.mark.parametrize(
    ("height", "visible"), [(1.99, False), (2.01, True), (29.99, True), (30.01, False)]
)
def test_range_ends_at_its_limits(height, visible):
    assert seen([(0, 0, height)], samples_of(((0, 0, 0), UP)), mesh_of(GROUND))[0, 0] == visible


def test_oblique_views_must_be_nearer_for_the_same_ground_sample_distance():
    # d / cos <= 10: 10 m straight on, 5 m at 60 degrees.
    rule = SightRule(d_min=1.0, d_max=30.0, max_incidence=math.radians(70.0), reach=10.0)
    oblique = np.array([math.sin(math.pi / 3), 0, math.cos(math.pi / 3)])
    at = [(0, 0, 9.99), (0, 0, 10.01), 4.99 * oblique, 5.01 * oblique]
    got = seen(at, samples_of(((0, 0, 0), UP)), mesh_of(GROUND), rule)
    np.testing.assert_array_equal(got[:, 0], [True, False, True, False])


def test_the_gimbal_limits_the_elevation_of_rays():
    camera = Camera(400, 200, 100.0)  # up to 45 degrees above the horizon in a level picture
    rule = SightRule.of(camera, ViewpointSettings(), d_min=2.0, d_max=30.0, gsd=1.0)
    facade = samples_of(((0, 0, 20), SOUTH))
    at = [(0, -10, 20 - 10 * math.tan(math.radians(angle))) for angle in (44.9, 45.1, -60.0)]
    np.testing.assert_array_equal(seen(at, facade, NOTHING, rule)[:, 0], [True, False, True])


def test_a_sample_behind_a_rounded_surface_is_still_seen():
    """The mesh lies 0.2 m above a sample of spacing 1 m: as a smoothed corner would."""
    sunk = samples_of(((0, 0, -0.2), UP), radius=1.0)
    assert seen([(0, 0, 10), (8, 0, 8)], sunk, mesh_of(GROUND)).all()


def test_lifting_does_not_jump_through_a_roof():
    """A floor 2 m under a slab stays hidden from above: lifting goes half a spacing at most."""
    slab = quad((-5, -5, 2), (10, 0, 0), (0, 10, 0))
    assert not seen([(0, 0, 12)], samples_of(((0, 0, 0), UP), radius=1.0), mesh_of(slab)).any()


def test_stages_count_where_pairs_end():
    camera = Camera(400, 200, 100.0)
    rule = SightRule.of(camera, ViewpointSettings(), d_min=2.0, d_max=30.0, gsd=0.1)  # reach 10
    samples = samples_of(((0, 5, 0), UP), ((0, -5, 9), (0.0, 0.0, -1.0)))
    positions = np.array([(0, -2, 8), (0, 4, 8), (0, 5, 25), (0, -5, 1)], dtype=float)
    got = visible_pairs(positions, samples, RayCaster(mesh_of(GROUND, WALL)), rule)
    # Of the ground behind the wall: (0, -2, 8) is too far for its incidence, (0, 4, 8) sees it,
    # (0, 5, 25) is too far. The ceiling is only met from below, against the gimbal.
    np.testing.assert_array_equal(got.stages[:, 0], [3, 3, 1, 1])
    np.testing.assert_array_equal(got.stages[:, 1], [1, 0, 0, 0])


def test_blocks_do_not_change_the_pairs(monkeypatch):
    rng = np.random.default_rng(0)
    xyz = np.column_stack([rng.uniform(-20, 20, (300, 2)), np.zeros(300)])
    samples = samples_of(*[(point, UP) for point in xyz])
    positions = rng.uniform((-20, -20, 3), (20, 20, 20), (70, 3))
    caster = RayCaster(mesh_of(GROUND, WALL))
    whole = visible_pairs(positions, samples, caster, RULE)
    monkeypatch.setattr(pairs_module, "_PAIRS", 1000)
    parts = visible_pairs(positions, samples, caster, RULE)
    for name in ("indptr", "sample", "distance", "cosine", "sector", "stages"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))


def test_sectors_split_the_cone_of_views_into_equal_solid_angles():
    """Uniform directions within 70 degrees of any normal spread evenly over all sectors."""
    rng = np.random.default_rng(1)
    least = math.cos(RULE.max_incidence)
    cosine, azimuth = rng.uniform(least + 1e-6, 1, 40_000), rng.uniform(0, 2 * np.pi, 40_000)
    sine = np.sqrt(1 - cosine**2)
    local = np.column_stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])
    for normal in (UP, SOUTH, (0.6, 0.0, 0.8)):
        first = np.cross(normal, (0.3, 0.5, 0.1))
        first /= np.linalg.norm(first)
        turn = np.array([first, np.cross(normal, first), normal])
        pairs = visible_pairs(
            10 * local @ turn, samples_of(((0, 0, 0), normal)), RayCaster(NOTHING), RULE
        )
        share = np.bincount(pairs.sector, minlength=8) / len(pairs)
        np.testing.assert_allclose(share, 1 / 8, atol=0.008)


@settings(max_examples=30, deadline=None)
@given(st.floats(-180, 180), st.integers(0, 2**32 - 1))
def test_turning_the_scene_about_z_changes_nothing(angle, seed):
    rng = np.random.default_rng(seed)
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    positions = rng.uniform((-12, -12, 2), (12, 12, 15), (30, 3))
    normals = rng.normal(size=(20, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    xyz = rng.uniform((-12, -12, 0.5), (12, 12, 12), (20, 3))
    mesh = mesh_of(GROUND, WALL)
    samples = SurfaceSamples(xyz, normals, np.zeros(20), 0.5)
    turned = SurfaceSamples(xyz @ turn.T, normals @ turn.T, np.zeros(20), 0.5)
    got = seen(positions, samples, mesh)
    again = seen(positions @ turn.T, turned, Mesh(mesh.vertices @ turn.T, mesh.triangles))
    assert np.count_nonzero(got != again) <= 1  # rays that graze the wall's rim


def aimed(positions, yaw, pitch):
    count = len(positions)
    return Viewpoints(
        np.array(positions, dtype=float), yaw, pitch, ("cover",) * count, np.full(count, -1)
    )


LIMITS = {"settings": ViewpointSettings(), "d_min": 2.0, "d_max": 30.0, "gsd": 1.0}


def test_coverage_counts_places_and_not_photos():
    ground = samples_of(((0, 0, 0), UP), ((18, 0, 0), UP))
    views = aimed([(0, 0, 10), (0, 0, 10), (4, 0, 10)], [0.0, 90.0, 0.0], [-90.0, -80.0, -90.0])
    got = coverage(views, mesh_of(GROUND), ground, Camera(400, 200, 100.0), **LIMITS)
    # All three see the near sample, but the first two share a place.
    np.testing.assert_array_equal(np.diff(got.indptr), [2, 1, 2])
    np.testing.assert_array_equal(got.hits, [2, 2])


def test_coverage_asks_what_is_in_the_picture():
    ground = samples_of(((15, 0, 0), UP), ((0, 15, 0), UP))
    camera = Camera(400, 200, 100.0)  # at 10 m: 20 m to each side, 10 m up and down
    for yaw, hits in ((0.0, [1, 0]), (90.0, [0, 1]), (180.0, [1, 0])):
        got = coverage(
            aimed([(0, 0, 10)], [yaw], [-90.0]), mesh_of(GROUND), ground, camera, **LIMITS
        )
        np.testing.assert_array_equal(got.hits, hits)


def test_no_viewpoints_see_nothing():
    got = coverage(
        aimed(np.empty((0, 3)), [], []),
        mesh_of(GROUND),
        samples_of(((0, 0, 0), UP)),
        Camera(),
        **LIMITS,
    )
    assert got.hits.tolist() == [0]
    assert got.sectors.tolist() == [0]


@pytest.mark.parametrize(
    "wrong", [{"d_min": -1.0}, {"d_max": 1.0}, {"max_incidence": 1.6}, {"reach": 0.0}]
)
def test_a_rule_out_of_range_is_refused(wrong):
    with pytest.raises(ValueError):
        SightRule(**{"d_min": 2.0, "d_max": 30.0, "max_incidence": 1.0, **wrong})


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=20)
def test_a_picture_shows_what_its_place_sees_within_the_frame(seed):
    rng = np.random.default_rng(seed)
    places = rng.uniform((-20, -20, 3), (20, 20, 25), (6, 3))
    ground = [((x, y, 0.0), UP) for x, y in rng.uniform(-20, 20, (60, 2))]
    samples, caster = samples_of(*ground), RayCaster(mesh_of(GROUND, WALL))
    camera = Camera(width_px=400, height_px=300, focal_px=300.0)
    yaw, pitch = rng.uniform(-180, 180, 6), rng.uniform(-90, 0, 6)
    whole = visible_pairs(places, samples, caster, RULE)
    part = visible_pairs(places, samples, caster, RULE, Aims(yaw, pitch, camera))
    rays = samples.xyz[whole.sample] - places[whole.position]
    inside = in_frustum(rays, yaw[whole.position], pitch[whole.position], camera)
    for name in ("position", "sample", "distance", "cosine", "sector"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[inside])
    np.testing.assert_array_equal(part.available, np.bincount(part.sample, minlength=60))
    pool = Pool.at(places, yaw, pitch, samples=samples, caster=caster, camera=camera, rule=RULE)
    np.testing.assert_array_equal(pool.sample, part.sample)
    expected = places[part.position] - samples.xyz[part.sample]
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(pool.rays(samples), expected, atol=1e-7)
