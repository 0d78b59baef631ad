"""Lengths follow from the box, the camera and the GSD, and leave room to fly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.config import ScaleSettings
from planner.errors import PlannerError
from planner.geometry.frames import Frame
from planner.scale import derive_scale, prior_noise
from planner.scene.cloud import PointCloud
from planner.scene.scene import Box, Ground, Scene
from planner.viewpoints.camera import Camera


def scene(longest, *, metric=True):
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 6)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    size = np.array([longest, 0.5 * longest, 0.2 * longest])
    return Scene(
        "block",
        PointCloud(grid * size),
        None,
        Ground(np.zeros((1, 1)), np.zeros(2), 1.0),
        Box(size / 2.0, np.eye(3), size),
        Frame(np.zeros(3)),
        metric=metric,
    )


def test_a_block_of_a_hundred_metres_by_hand():
    scale = derive_scale(scene(100.0), Camera(), ScaleSettings())
    assert scale.radius == pytest.approx(1.5)
    assert scale.gsd == pytest.approx(0.015)
    assert scale.d_min == pytest.approx(3.0)
    assert scale.d_max == pytest.approx(0.015 * 3652.0 * np.cos(np.pi / 4))
    assert scale.poisson_depth == 8
    assert {rule.name for rule in scale.rules} >= {"radius", "gsd", "d_min", "d_max", "voxel"}


@given(st.floats(1.0, 5000.0), st.booleans(), st.floats(30.0, 120.0))
def test_there_is_always_room_between_the_distances_and_never_less_than_safety(
    longest, metric, diagonal
):
    camera = Camera.from_field_of_view(width_px=4000, height_px=3000, diagonal_deg=diagonal)
    scale = derive_scale(scene(longest, metric=metric), camera, ScaleSettings())
    assert 0.0 < scale.d_min < 0.8 * scale.d_max
    if metric:
        assert scale.d_min >= 2.0 + scale.prior_noise


def test_a_refusal_names_both_distances():
    with pytest.raises(PlannerError, match=r"d_min 30 m .* d_max 20 m"):
        derive_scale(scene(100.0), Camera(), ScaleSettings(d_min=30.0, d_max=20.0))


def test_what_the_user_sets_is_kept_and_said():
    scale = derive_scale(scene(100.0), Camera(), ScaleSettings(radius=0.7, gsd=0.01))
    assert (scale.radius, scale.gsd) == (0.7, 0.01)
    assert [r.because for r in scale.rules if r.name in {"radius", "gsd"}] == [
        "set by the user"
    ] * 2


def test_noise_of_a_plane_is_the_noise_put_on_it():
    rng = np.random.default_rng(1)
    xyz = np.column_stack([rng.random((5000, 2)) * 30.0, rng.normal(0.0, 0.1, 5000)])
    assert prior_noise(xyz) == pytest.approx(0.0674 * 0.9, rel=0.15)  # median of |N(0, 0.1)|
    assert prior_noise(xyz * [1.0, 1.0, 0.0]) == pytest.approx(0.0, abs=1e-9)
