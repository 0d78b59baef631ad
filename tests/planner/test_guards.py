"""Samples that guard the photos are drawn only where the photos are chosen with them."""

import numpy as np
import pytest

from planner import load_config, synthetic_scene
from planner.attempts import study
from planner.clock import Clock


@pytest.fixture(scope="module")
def scene():
    return synthetic_scene(3, size=(42.0, 40.0), buildings=2, spacing=1.0)


def guards_of(scene, *given):
    return study(scene, load_config(None, ["scale.radius_share=0.1", *given]), Clock(None)).guards


@pytest.mark.parametrize("given", [(), ("viewpoints.minutes=5",)])
def test_fewest_photos_are_guarded_by_fresh_samples(scene, given):
    guards = guards_of(scene, *given)
    assert len(guards) > 100
    np.testing.assert_array_equal(guards.xyz, guards_of(scene, *given).xyz)


@pytest.mark.parametrize("given", ["objective=hits", "preset=paper", "preset=smith", "budget=9"])
def test_other_choices_do_not_wait_for_them(scene, given):
    assert guards_of(scene, f"viewpoints.{given}") is None
