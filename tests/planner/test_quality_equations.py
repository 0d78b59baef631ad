"""Eqs. 1 to 5 on numbers small enough to work out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.config import QualitySettings
from planner.scene.cleaning import thin
from planner.scene.cloud import PointCloud
from planner.surface.completeness import (
    completeness,
    density_weight,
    neighbour_counts,
    reference_count,
)
from planner.surface.quality import normalised, product, score_quality
from planner.surface.quantile import grouped_quantile
from planner.surface.samples import SurfaceSamples
from planner.surface.smoothness import distance_weight, flatness, roughness, smoothness

UP = np.array([[0.0, 0.0, 1.0]])


def one_sample(radius=2.0):
    return SurfaceSamples(np.zeros((1, 3)), UP, np.zeros(1, int), radius)


def grid_samples(side=20, radius=1.0):
    x, y = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    xyz = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * radius * 1.1
    return SurfaceSamples(xyz, np.tile(UP, (len(xyz), 1)), np.zeros(len(xyz), int), radius)


@pytest.mark.parametrize(
    ("form", "empty", "half", "full"), [("intended", 0.0, 0.25, 1.0), ("printed", 4.0, 2.25, 1.0)]
)
def test_eq_1_weight_as_intended_and_as_printed(form, empty, half, full):
    counts, reference = np.array([0, 5, 10, 20]), np.full(4, 10.0)
    np.testing.assert_allclose(density_weight(counts, reference, form), [empty, half, full, full])


def test_eq_1_is_weight_times_gradient_along_the_normal():
    weight, gradient = np.array([0.5, 0.5, 1.0]), np.array([[0, 0, 2.0], [3.0, 0, 0], [0, 0, -1.0]])
    got = completeness(weight, gradient, np.tile(UP, (3, 1)))
    np.testing.assert_allclose(got, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(completeness(weight, None, np.tile(UP, (3, 1))), weight)


def test_neighbours_are_counted_within_the_radius_alone():
    points = np.array([[0, 0, 1.9], [0, 2.1, 0], [1.0, 1.0, 1.0], [2.0, 0, 0]])
    np.testing.assert_array_equal(neighbour_counts(one_sample(), points), [3])


def test_the_largest_count_is_the_papers_reference():
    counts = np.array([3, 0, 12])
    np.testing.assert_allclose(reference_count(grid_samples(), counts, "maximum"), [12, 12, 12])


def test_an_even_density_needs_no_more_than_it_has_also_at_the_rim():
    samples = grid_samples()
    inner = np.abs(samples.xyz[:, :2] - samples.xyz[:, :2].mean(axis=0)).max(axis=1) < 10.0
    counts = np.where(inner, 400, 200)  # half of each disk at the rim lies outside
    corner = np.isin(np.arange(400), [0, 19, 380, 399])
    counts[corner] = 100
    share = counts / reference_count(samples, counts, "local")
    assert share[inner].min() >= 1.0
    assert share[~corner].min() > 0.75
    assert share[corner].min() > 0.5


def test_a_sparse_facade_expects_less_than_the_roof_but_not_as_little_as_it_has():
    roof = grid_samples()
    facade = np.tile([[1.0, 0.0, 0.0]], (400, 1))
    samples = SurfaceSamples(
        np.vstack(
            [roof.xyz, roof.xyz @ np.array([[0, 0, 1.0], [0, 1, 0], [1, 0, 0]]) + [60, 0, 0]]
        ),
        np.vstack([roof.normals, facade]),
        np.zeros(800, int),
        1.0,
    )
    counts = np.repeat([900, 100], 400)
    middle = np.array([210, 610])
    reference = reference_count(samples, counts, "local")[middle]
    noise = np.sqrt([900.0, 300.0])
    np.testing.assert_allclose(reference, np.array([900.0, 300.0]) - 2.0 * noise, rtol=0.08)


def test_no_points_at_all_leave_a_reference_of_one():
    np.testing.assert_allclose(reference_count(grid_samples(), np.zeros(400, int), "local"), 1.0)


def test_eq_3_falls_to_one_over_e_at_the_radius():
    np.testing.assert_allclose(distance_weight(np.array([0.0, 2.0]), 2.0), [1.0, np.exp(-1.0)])


def test_eq_2_sums_weighted_agreement():
    angle = np.pi / 3
    tilted = [np.sin(angle), 0.0, np.cos(angle)]
    cloud = PointCloud(
        np.array([[0, 0, 0], [1.0, 0, 0], [9.0, 0, 0]]), np.array([UP[0], tilted, UP[0]])
    )
    far, agree = np.exp(-0.5), np.exp(-1.0)
    total = smoothness(one_sample(), cloud, angle=angle, form="sum")
    np.testing.assert_allclose(total, [1.0 + far * agree])
    mean = smoothness(one_sample(), cloud, angle=angle, form="mean")
    np.testing.assert_allclose(mean, [(1.0 + far * agree) / (1.0 + far)])


def test_eq_2_is_zero_without_neighbours():
    cloud = PointCloud(np.full((1, 3), 50.0), UP)
    for form in ("sum", "mean"):
        assert smoothness(one_sample(), cloud, angle=0.5, form=form) == 0.0
    assert flatness(one_sample(), cloud, limit=0.1) == 0.0


def test_roughness_is_the_distance_to_the_local_plane():
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.random((500, 2)) * 10.0, np.zeros(500)])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    np.testing.assert_allclose(roughness(PointCloud(flat @ turn)), 0.0, atol=1e-6)
    ball = rng.normal(size=(500, 3))
    assert np.median(roughness(PointCloud(ball))) > 0.1


def test_edges_are_flat_and_noise_is_not():
    rng = np.random.default_rng(1)
    a, b = rng.random((2, 4000, 2)) * 4.0 - [2.0, 0.0]
    edge = np.vstack(
        [
            np.column_stack([a[:, 0], a[:, 1], 0 * a[:, 0]]),
            np.column_stack([b[:, 0], 0 * b[:, 0], -b[:, 1]]),
        ]
    )
    samples = SurfaceSamples(np.zeros((1, 3)), UP, np.zeros(1, int), 1.0)
    assert flatness(samples, thin(PointCloud(edge), 0.25), limit=0.06) > 0.99
    noisy = thin(PointCloud(edge + rng.normal(scale=0.5, size=edge.shape)), 0.25)
    assert flatness(samples, noisy, limit=0.06) < 0.35


def test_eq_4_is_the_product():
    np.testing.assert_allclose(product(np.array([0.5, 2.0]), np.array([0.5, 0.25])), [0.25, 0.5])


def test_eq_5_is_min_max_when_nothing_is_clipped():
    got = normalised(np.array([1.0, 3.0, 2.0]), clip_percent=0.0)
    np.testing.assert_allclose(got, [0.0, 1.0, 0.5])


def test_one_outlier_does_not_move_the_others_when_clipped():
    plain = np.linspace(0.0, 1.0, 999)
    got = normalised(np.append(plain, 1e6), clip_percent=1.0)
    np.testing.assert_allclose(got[:-1], plain, atol=0.03)


@given(arrays(np.float64, st.integers(0, 50), elements=st.floats(0, 1e6)), st.floats(0, 20))
def test_quality_is_a_share_that_keeps_the_order(values, clip):
    got = normalised(values, clip_percent=clip)
    assert ((got >= 0.0) & (got <= 1.0)).all()
    assert (np.diff(got[np.argsort(values, kind="stable")]) >= 0.0).all()


@given(st.lists(st.tuples(st.integers(0, 5), st.floats(-10, 10)), max_size=40), st.floats(0.0, 1.0))
def test_grouped_quantiles_are_the_quantiles_of_the_groups(pairs, share):
    group = np.array([g for g, _ in pairs], dtype=np.int64)
    values = np.array([v for _, v in pairs], dtype=np.float64)
    groups, quantiles = grouped_quantile(group, values, share)
    np.testing.assert_array_equal(groups, np.unique(group))
    for g, q in zip(groups, quantiles, strict=True):
        assert q == np.quantile(values[group == g], share, method="lower")


@pytest.mark.parametrize("gradient", ["none", "smoothed", "spectral"])
@pytest.mark.parametrize("weight", ["intended", "printed"])
def test_a_hole_scores_lowest_unless_the_weight_is_the_printed_one(gradient, weight):
    samples = grid_samples(12)
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.random((40_000, 2)) * 15.0 - 1.5, np.zeros(40_000)])
    centre = samples.xyz[:, :2].mean(axis=0)
    points = points[np.linalg.norm(points[:, :2] - centre, axis=1) > 2.5]
    rows = np.unique(np.floor(points / 0.25), axis=0, return_index=True)[1]
    thinned = PointCloud(points[rows], np.tile(UP, (len(rows), 1)))
    settings = QualitySettings(gradient=gradient, density_weight=weight)
    scored = score_quality(samples, PointCloud(points), thinned=thinned, settings=settings)
    hole = np.linalg.norm(samples.xyz[:, :2] - centre, axis=1) < 1.4
    if weight == "intended":
        assert scored.quality[hole].max() < scored.quality[~hole].min()
    elif gradient == "none":
        assert scored.completeness[hole].min() > scored.completeness[~hole].max()
