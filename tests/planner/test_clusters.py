"""Clusters: as many as wanted, equal in size, compact in position and normal."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.surface.clusters import cluster_samples


def directed(count, seed):
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    return rng.random((count, 3)) * [50, 30, 10], normals / np.linalg.norm(
        normals, axis=1, keepdims=True
    )


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 300), st.integers(1, 40), st.integers(0, 1000))
def test_each_wanted_cluster_exists_and_none_is_much_larger(samples, count, seed):
    xyz, normals = directed(samples, seed)
    sizes = np.bincount(cluster_samples(xyz, normals, count))
    assert len(sizes) == min(count, samples)
    assert sizes.min() >= 1
    assert sizes.max() - sizes.min() <= max(3, samples // min(count, samples) // 4 + 1)


def test_both_sides_of_a_thin_wall_fall_apart():
    rng = np.random.default_rng(0)
    xyz = rng.random((200, 3)) * [1.0, 0.01, 1.0]
    normals = np.zeros((200, 3))
    normals[:, 1] = np.where(np.arange(200) < 100, 1.0, -1.0)
    cluster = cluster_samples(xyz, normals, 2, normal_weight=2.0)
    assert set(cluster[:100]).isdisjoint(cluster[100:])


def test_far_apart_buildings_fall_apart():
    xyz, normals = directed(90, 1)
    xyz[30:60] += [500.0, 0, 0]
    xyz[60:] += [0, 900.0, 0]
    cluster = cluster_samples(xyz, normals, 3)
    assert all(len(set(cluster[i : i + 30])) == 1 for i in (0, 30, 60))


def test_the_order_of_the_samples_does_not_matter():
    xyz, normals = directed(101, 4)
    shuffle = np.random.default_rng(9).permutation(101)
    straight = cluster_samples(xyz, normals, 7)
    shuffled = cluster_samples(xyz[shuffle], normals[shuffle], 7)
    np.testing.assert_array_equal(straight[shuffle], shuffled)


def test_coincident_samples_and_none_at_all_are_fine():
    assert len(cluster_samples(np.empty((0, 3)), np.empty((0, 3)), 4)) == 0
    cluster = cluster_samples(np.zeros((8, 3)), np.tile([0.0, 0, 1], (8, 1)), 4)
    np.testing.assert_array_equal(np.bincount(cluster), [2, 2, 2, 2])


def test_less_than_one_cluster_is_refused():
    with pytest.raises(ValueError, match="at least 1"):
        cluster_samples(np.zeros((3, 3)), np.zeros((3, 3)), 0)
