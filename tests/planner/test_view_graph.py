"""Links between photos, and what pairs of them can triangulate."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.scene.cloud import Mesh
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.graph import view_graph
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import pair_sums, parallax_weight, reconstructability
from planner.viewpoints.viewpoints import Viewpoints
from planner.viewpoints.visibility import Coverage

GRID = np.stack(np.meshgrid(np.arange(40.0), np.arange(5.0), [0.0]), -1).reshape(-1, 3)
SAMPLES = SurfaceSamples(GRID, np.tile([0.0, 0.0, 1.0], (200, 1)), np.zeros(200), 1.0)


def looking_down(x, height=10.0, pitch=-90.0):
    count = len(x)
    positions = np.column_stack([x, np.full(count, 2.0), np.broadcast_to(height, count)])
    pitch = np.broadcast_to(pitch, count)
    return Viewpoints(positions, np.zeros(count), pitch, ("cover",) * count, np.zeros(count))


def strips(*spans):
    """Coverage of views that see the columns ``first`` to ``last`` of the grid."""
    rows = [np.flatnonzero((GRID[:, 0] >= a) & (GRID[:, 0] < b)) for a, b in spans]
    indptr = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    zeros = np.zeros(200, dtype=int)
    return Coverage(indptr, np.concatenate(rows).astype(np.int32), zeros, zeros)


def test_views_link_by_shared_samples_into_components():
    views = looking_down([5, 12, 30])
    graph = view_graph(views, strips((0, 10), (7, 17), (25, 35)), SAMPLES)
    assert graph.edges.tolist() == [[0, 1]]  # 15 of 50 samples, exactly the limits
    assert graph.components == 2
    assert graph.degree.tolist() == [1, 1, 0]
    assert not len(view_graph(views, strips((0, 10), (8, 18), (25, 35)), SAMPLES).edges)


def test_views_that_look_apart_or_from_other_distances_do_not_link():
    seen = strips((0, 10), (0, 10))
    assert len(view_graph(looking_down([5, 6]), seen, SAMPLES).edges) == 1
    turned = looking_down([5, 6], pitch=np.array([-90.0, -49.0]))
    assert not len(view_graph(turned, seen, SAMPLES).edges)
    far = looking_down([5, 6], height=np.array([10.0, 30.0]))
    assert not len(view_graph(far, seen, SAMPLES).edges)


def test_small_views_link_by_half_of_what_the_smaller_one_sees():
    # 10 samples each: 5 shared are half of them, though fewer than 15.
    assert len(view_graph(looking_down([5, 6]), strips((0, 2), (1, 3)), SAMPLES).edges) == 1


def test_no_views_make_an_empty_graph():
    nothing = np.empty(0, dtype=np.int32)
    empty = Coverage(np.zeros(1, dtype=int), nothing, np.zeros(200), np.zeros(200))
    assert view_graph(looking_down(np.empty(0)), empty, SAMPLES).components == 0


def test_parallax_weight_has_its_published_values():
    angles = np.radians([5, 10, 15, 20, 30, 45, 60])
    expected = [0.0295, 0.330, 0.877, 0.963, 0.890, 0.500, 0.110]
    np.testing.assert_allclose(parallax_weight(angles), expected, atol=6e-4)


@given(st.integers(0, 2**32 - 1))
def test_pair_sums_are_those_of_brute_force(seed):
    rng = np.random.default_rng(seed)
    count, size = 25, 6
    sample = rng.integers(0, size, count)
    rays = rng.normal(size=(count, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    distance, cosine = rng.uniform(1, 30, count), rng.uniform(-0.2, 1, count)
    expected = np.zeros(size)
    for i, j in itertools.combinations(range(count), 2):
        if sample[i] == sample[j]:
            angle = np.arccos(np.clip(rays[i] @ rays[j], -1, 1))
            near = max(0.0, 1 - max(distance[i], distance[j]) / 25.0)
            facing = max(0.0, min(cosine[i], cosine[j]))
            expected[sample[i]] += parallax_weight(angle) * near * facing
    got = pair_sums(sample, rays, distance, cosine, size=size, reference=25.0)
    np.testing.assert_allclose(got, expected, atol=1e-12)


def test_reconstructability_of_two_views_worked_by_hand():
    """Two views 20 degrees apart, each 10 degrees off the normal, at half the reference."""
    sample = SurfaceSamples([[0, 0, 0]], [[0, 0, 1]], [0], 1.0)
    offset = 10 * np.sin(np.radians(10))
    positions = np.array([[offset, 0, 10 * np.cos(np.radians(10))]] * 2)
    positions[1, 0] *= -1
    views = Viewpoints(positions, [0, 0], [-90, -90], ("cover",) * 2, [0, 0])
    caster = RayCaster(Mesh(np.empty((0, 3)), np.empty((0, 3))))
    got = reconstructability(views, sample, caster, Camera(), reference=20.0)
    assert got[0] == pytest.approx(0.963 * 0.5 * np.cos(np.radians(10)), abs=5e-4)
