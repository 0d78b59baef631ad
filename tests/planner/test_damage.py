"""Damage does what it says, and areas under the ROC curve are right."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.evaluation.damage import (
    Damage,
    apply_damages,
    damaged_samples,
    place_damages,
    roc_auc,
    untouched_samples,
)
from planner.scene.cloud import PointCloud

BALLS = (
    Damage("hole", (10.0, 10.0, 0.0), 4.0),
    Damage("thinned", (30.0, 10.0, 0.0), 5.0),
    Damage("noisy", (50.0, 10.0, 0.0), 5.0),
)


def cloud():
    xyz = np.random.default_rng(0).random((8000, 3)) * [60.0, 20.0, 0.0]
    return PointCloud(xyz, np.tile([0.0, 0, 1], (8000, 1)), classes=np.arange(8000) % 200)


def within(xyz, ball):
    return np.linalg.norm(xyz - np.array(ball.centre), axis=1) <= ball.radius


def test_holes_are_empty_a_quarter_stays_and_noise_has_its_size():
    before = cloud()
    after = apply_damages(before, BALLS, noise=0.7, seed=1)
    hole, thinned, noisy = BALLS
    assert not within(after.xyz, hole).any()
    assert within(after.xyz, thinned).sum() == round(within(before.xyz, thinned).sum() / 4)
    moved = after.xyz[after.xyz[:, 2] != 0.0]
    assert len(moved) == within(before.xyz, noisy).sum()
    assert np.std(moved[:, 2]) == pytest.approx(0.7, rel=0.1)
    assert after.normals is None


def test_nothing_changes_outside_of_the_balls():
    before = cloud()
    after = apply_damages(before, BALLS, noise=0.7, seed=1)
    outside = ~np.any([within(before.xyz, ball) for ball in BALLS], axis=0)
    kept = {tuple(p) for p in after.xyz}
    assert {tuple(p) for p in before.xyz[outside]} <= kept


def test_the_same_seed_does_the_same_damage():
    first, again = (apply_damages(cloud(), BALLS, noise=0.7, seed=3).xyz for _ in range(2))
    np.testing.assert_array_equal(first, again)


@given(st.integers(0, 500))
def test_balls_keep_apart_and_are_centred_on_places(seed):
    places = np.random.default_rng(1).random((400, 3)) * [100.0, 100.0, 5.0]
    balls = place_damages(
        places, ("hole",) * 3 + ("noisy",) * 3, smallest=3.0, largest=8.0, gap=2.0, seed=seed
    )
    assert [ball.kind for ball in balls] == ["hole"] * 3 + ["noisy"] * 3
    for i, a in enumerate(balls):
        assert 3.0 <= a.radius <= 8.0
        assert any(np.array_equal(a.centre, place) for place in places)
        for b in balls[:i]:
            apart = np.linalg.norm(np.subtract(a.centre, b.centre))
            assert apart >= a.radius + b.radius + 2.0 - 1e-9


def test_too_many_balls_are_refused():
    with pytest.raises(ValueError, match="no room"):
        place_damages(np.zeros((5, 3)), ("hole",) * 2, smallest=1.0, largest=2.0, gap=0.0, seed=0)


def test_samples_belong_to_cores_and_are_untouched_beyond_the_margin():
    samples = np.array([[10.0, 13.1, 0], [10.0, 13.5, 0], [10.0, 14.5, 0], [10.0, 15.1, 0]])
    np.testing.assert_array_equal(damaged_samples(samples, BALLS), [0, -1, -1, -1])
    np.testing.assert_array_equal(
        untouched_samples(samples, BALLS, margin=1.0), [False, False, False, True]
    )


def test_roc_auc_by_hand():
    bad = np.array([True, True, False, False])
    assert roc_auc(np.array([0.0, 0.1, 0.5, 0.9]), bad) == 1.0
    assert roc_auc(np.array([0.9, 0.5, 0.1, 0.0]), bad) == 0.0
    assert roc_auc(np.array([0.2, 0.5, 0.5, 0.9]), bad) == 0.875
    assert roc_auc(np.zeros(4), bad) == 0.5
    assert np.isnan(roc_auc(np.zeros(4), np.zeros(4, dtype=bool)))


@given(st.lists(st.tuples(st.integers(0, 4), st.booleans()), min_size=2, max_size=30))
def test_roc_auc_is_the_share_of_pairs_in_the_right_order(pairs):
    quality = np.array([q for q, _ in pairs], dtype=float)
    bad = np.array([b for _, b in pairs])
    wins = [(q < g) + 0.5 * (q == g) for q in quality[bad] for g in quality[~bad]]
    if wins:
        assert roc_auc(quality, bad) == pytest.approx(np.mean(wins))
