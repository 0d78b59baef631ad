"""Samples that only a zone or the ceiling keeps from being photographed."""

import numpy as np
import pytest

from planner.config import ViewpointSettings
from planner.scene.cloud import Mesh
from planner.surface.samples import ScoredSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.select import select_viewpoints

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
LIMITS = {"d_min": 3.0, "d_max": 22.0, "gsd": 30.0 / 400.0}
FLOOR = Mesh(
    np.array([[-40, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]]), [[0, 1, 2], [0, 2, 3]]
)
COVER = Mesh(
    np.vstack([FLOOR.vertices, FLOOR.vertices + [0, 0, 2.0]]),
    np.vstack([FLOOR.triangles, FLOOR.triangles + 4]),
)


class HalfSpace:
    """Free above the ground, but for what lies beyond a plane or above a ceiling."""

    d_min = 3.0

    def __init__(self, *, west_of=np.inf, below=np.inf):
        self.west_of, self.below = west_of, below

    def clearance(self, points):
        return points[:, 2]

    def zone_margin(self, points):
        return np.minimum(self.west_of - points[:, 0], self.below - points[:, 2])


def reason(x, airspace, mesh=FLOOR, positions=((-38.0, 0.0, 10.0),)):
    one = np.ones(1)
    sample = ScoredSamples([[x, 0.0, 0.0]], [[0.0, 0.0, 1.0]], [0], 1.0, one, one, one)
    got = select_viewpoints(
        *(np.array(positions), mesh, sample, CAMERA),
        settings=ViewpointSettings(objective="hits"),
        voxel=4.0,
        airspace=airspace,
        **LIMITS,
    )
    return got.reasons[got.reason[0]]


@pytest.mark.parametrize("x", [5.0, 12.0, 30.0])
def test_behind_a_wall_of_a_zone(x):
    assert reason(x, HalfSpace(west_of=-10.0)) == "zone"


def test_under_too_low_a_ceiling():
    assert reason(0.0, HalfSpace(below=3.5)) == "zone"


def test_a_zone_far_away_is_not_to_blame():
    assert reason(0.0, HalfSpace(west_of=60.0)) == "no-free-position"
    assert reason(0.0, HalfSpace()) == "no-free-position"


def test_what_a_roof_hides_is_not_blamed_on_the_zone_above_it():
    over = ((0.0, 0.0, 12.0),)
    assert reason(0.0, HalfSpace(west_of=-10.0), mesh=COVER, positions=over) == "occluded"
