"""The block that the choice of photos is measured on is what it says it is."""

import numpy as np
import pytest

from planner.scale import derive_scale
from planner.scene.benchmark import CLEARANCE, REFERENCE, benchmark_block, benchmark_config
from planner.viewpoints.camera import camera_of


def test_block_has_the_size_and_towers_of_the_literature():
    scene = benchmark_block()
    np.testing.assert_allclose(np.sort(scene.box.size), [25.0, 60.0, 85.0], atol=0.5)
    assert benchmark_block().sha256 == scene.sha256
    assert benchmark_block(1).sha256 != scene.sha256


def test_settings_give_the_camera_and_the_reference_distance():
    config = benchmark_config(7)
    camera = camera_of(config.camera)
    assert np.degrees(camera.horizontal_fov) == pytest.approx(60.0)
    assert np.degrees(camera.vertical_fov) == pytest.approx(36.0, abs=0.02)
    scale = derive_scale(benchmark_block(), camera, config.scale)
    assert scale.d_min == CLEARANCE
    assert 2.0 * scale.d_max == pytest.approx(REFERENCE)
    assert 2.0 * camera.distance_for(scale.gsd, 0.0) == pytest.approx(REFERENCE)
    assert config.seed == 7
