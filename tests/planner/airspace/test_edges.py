"""Sweeps and edges against brute force over all triangles and points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.airspace.airspace import build_airspace
from planner.airspace.collision import Triangles
from planner.airspace.obstacles import Points
from planner.config import AirspaceSettings, ZoneSettings
from planner.flight.certificate import certify
from planner.geometry import bezier
from planner.scene.cloud import Mesh

seeds = st.integers(0, 2**31)


def segments(rng, count, spread=18.0):
    """Random segments of all lengths, some of them points, some along an axis."""
    a = rng.uniform((-spread, -spread, 8 - spread), (spread, spread, 8 + spread), (count, 3))
    step = rng.normal(size=(count, 3))
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    step *= 10 ** rng.uniform(-6, 1.5, (count, 1))
    step[::7] = 0.0
    step[1::7, :2] = 0.0
    step[2::7, 1:] = 0.0
    return zip(a, a + step, strict=True)


@settings(max_examples=25, deadline=None)
@given(seeds, st.booleans(), st.sampled_from([0.02, 1.0, 40.0]))
def test_a_sweep_is_clear_exactly_when_all_triangles_are_far_enough(make, brute, seed, far, scale):
    mesh = make.soup(seed)
    offset = np.array([900.0, -700, 50]) * far
    mesh = Mesh(mesh.vertices * scale + offset, mesh.triangles)
    triangles, corners = Triangles(mesh), mesh.vertices[mesh.triangles]
    late = 2e-5 + 1e-6 * scale  # metres by which a sweep may be stricter than exact
    for a, b in segments(np.random.default_rng(seed), 12):
        a, b = a * scale + offset, b * scale + offset
        truth = brute.segment(a, b, corners)
        for radius in (0.5 * truth, truth - late, truth + 2e-6, truth + late, 1.5 * truth, 0.1):
            if radius > 0:
                clear = triangles.capsule_is_clear(a, b, radius)
                assert clear if radius <= truth - late else (not clear or radius <= truth)


@settings(max_examples=25, deadline=None)
@given(seeds, st.floats(0.3, 6.0), st.integers(1, 300))
def test_a_sweep_sees_every_point(brute, seed, cell, count):
    rng = np.random.default_rng(seed)
    cloud = rng.uniform((-15, -15, -7), (15, 15, 23), (count, 3))
    points, corners = Points(cloud, cell=cell), np.repeat(cloud[:, None], 3, axis=1)
    for a, b in segments(rng, 20):
        truth = brute.segment(a, b, corners)
        for radius in (0.5 * truth, truth - 1e-9, truth + 1e-9, 3.0 * truth):
            assert points.capsule_is_clear(a, b, radius) == (radius < truth)
    at = rng.uniform(-30, 30, (50, 3))
    np.testing.assert_allclose(points.distance(at), brute.points(at, corners), atol=1e-12)


def test_no_points_are_far_from_everywhere():
    points = Points(np.zeros((0, 3)), cell=1.0)
    assert points.capsule_is_clear(np.zeros(3), np.ones(3), 1e6)
    assert points.distance(np.zeros((2, 3))).tolist() == [np.inf, np.inf]


def test_points_of_a_very_long_scene_still_fit(brute):
    cloud = np.random.default_rng(0).uniform((0, 0, 0), (30_000, 20_000, 50), (500, 3))
    points = Points(cloud, cell=1.0)
    a, b = cloud[7] + [0, 0, 2.0], cloud[7] + [300, 0, 2.0]
    truth = brute.segment(a, b, np.repeat(cloud[:, None], 3, axis=1))
    assert points.capsule_is_clear(a, b, truth - 1e-9)
    assert not points.capsule_is_clear(a, b, truth + 1e-9)


@pytest.fixture(scope="module")
def town(make):
    """Blocks, a bridge, a mast and a zone."""
    blocks = [
        *[((-14, -14, 0), (-6, -6, 12)), ((4, -12, 0), (12, -2, 7))],
        ((-12, 4, 0), (-4, 14, 16)),
        ((2, 6, 9), (16, 10, 10)),
    ]
    mast = np.column_stack([np.full(80, 0.0), np.full(80, 0.5), np.linspace(0, 14, 80)])
    zone = ZoneSettings(polygon=((8, 12), (19, 12), (19, 19), (8, 19)), top=12.0)
    return blocks, build_airspace(
        make.scene(mast),
        make.boxes(blocks),
        d_min=2.0,
        d_max=15.0,
        settings=AirspaceSettings(zones=(zone,), ceiling=25.0),
    )


def test_every_point_of_a_free_edge_is_free_and_a_refused_edge_has_a_reason(town, solids):
    blocks, airspace = town
    truth, rng = solids(blocks, ground=0.0), np.random.default_rng(3)
    free = 0
    for a, b in zip(*rng.uniform((-30, -30, 0), (30, 30, 27), (2, 250, 3)), strict=True):
        along = a + np.linspace(0, 1, 500)[:, None] * (b - a)
        clear = np.minimum(
            truth.clearance(along),
            np.linalg.norm(along[:, None] - airspace.obstacles, axis=2).min(axis=1),
        )
        least = min(clear.min() - 2.0, airspace.zone_margin(along).min())
        if airspace.edge_is_free(a, b):
            free += 1
            assert least >= 0.0
            assert airspace.is_free(along[::50]).all()
        else:
            assert least <= 0.5 * np.linalg.norm(b - a) / 499 + 2e-3
    assert 30 < free < 200


def test_an_edge_is_free_in_both_directions_or_in_none(town):
    _, airspace = town
    rng = np.random.default_rng(4)
    for a, b in zip(*rng.uniform((-30, -30, 0), (30, 30, 27), (2, 150, 3)), strict=True):
        assert airspace.edge_is_free(a, b) == airspace.edge_is_free(b, a)


@pytest.mark.parametrize(
    ("a", "b", "free"),
    [
        ((-20, 0, 16), (20, 0, 20), True),
        ((-10, -20, 5), (-10, 0, 5), False),  # through a block
        ((-10, -10, 6), (-10, -10, 6), False),  # a point in its middle, far from its walls
        ((-10, -10, 14.1), (-10, -10, 14.1), True),  # a point above it
        ((9, 1, 4), (9, 11, 4), True),  # under the bridge
        ((9, 1, 8), (9, 11, 8), False),  # against it
        ((13, 2, 5), (13, 18, 5), False),  # from under the bridge into the zone
        ((13, 18, 13), (13, 5, 13), True),  # above zone and bridge
        ((0, 18, 24.9), (0, -18, 24.9), True),
        ((0, 18, 24.9), (0, -18, 25.1), False),  # through the ceiling
        ((0, -18, 3), (0, 18, 3), False),  # through the mast
    ],
)
def test_edges_of_a_town_worked_out_by_hand(town, a, b, free):
    _, airspace = town
    if (a, b) == ((13, 2, 5), (13, 18, 5)):
        assert airspace.capsule_clearance_at_least(np.array(a), np.array(b), 2.0)
    assert airspace.edge_is_free(np.array(a, float), np.array(b, float)) == free


def test_a_curve_deep_inside_of_a_hollow_shell_is_refused_though_sweeps_are_clear(make):
    shell = make.boxes([((-12, -12, 0), (12, 12, 24))])
    airspace = build_airspace(make.scene(), shell, d_min=2.0, d_max=12.0)
    inside = bezier.straight(np.array([[-4.0, 0, 12]]), np.array([[4.0, 0, 12]]))
    assert airspace.capsule_clearance_at_least(inside[0, 0], inside[0, 3], 2.0)  # hollow to FCL
    assert not certify(inside, airspace).safe[0]
    above = inside + [0, 0, 15.0]
    assert certify(above, airspace).safe[0]
