"""Reasons of samples placed by hand, whose truth follows from how the place is made."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from planner.config import ViewpointSettings
from planner.geometry.angles import yaw_pitch
from planner.report.overview import REASON_MARKS
from planner.scene.cloud import Mesh
from planner.surface.samples import ScoredSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.demand import Demand
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reasons import REASONS
from planner.viewpoints.select import select_viewpoints
from planner.viewpoints.selection import PairWish, Wish, assess
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints

UP, DOWN, EAST = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)
D_MIN, D_MAX = 3.0, 22.0
FAR = 60.0  # half of the ground
A_CASE = 12  # samples of each case
CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
LOWERED = replace(CAMERA, pitch_max_deg=-10.0)  # sees up to 17 degrees above the horizon
SHALLOW = replace(CAMERA, pitch_min_deg=-30.0)  # and down to 57 degrees below it


def box(x, y, z):
    """Corners of a box from its three ranges."""
    return np.array([[x[0], y[0], z[0]], [x[1], y[1], z[1]]], dtype=float)


def mesh_of(boxes):
    """All faces of the boxes, and the ground."""
    ground = np.array([[-FAR, -FAR, 0], [FAR, -FAR, 0], [FAR, FAR, 0], [-FAR, FAR, 0]])
    vertices, triangles = [ground], [[0, 1, 2], [0, 2, 3]]
    quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    for x, y, z in (corners.T for corners in boxes):
        first = 4 + 8 * (len(vertices) - 1)
        vertices.append(
            np.array([[x[i], y[j], z[k]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
        )
        for a, b, c, d in np.array(quads) + first:
            triangles += [[a, b, c], [a, c, d]]
    return Mesh(np.concatenate(vertices), triangles)


class Place:
    """Boxes on level ground, forbidden prisms, exact distances."""

    d_min = D_MIN

    def __init__(self, boxes=(), prisms=(), ceiling=np.inf):
        self.boxes, self.prisms, self.ceiling = list(boxes), list(prisms), ceiling

    @staticmethod
    def _outside(corners, points):
        out = np.maximum(corners[0] - points, points - corners[1])
        away = np.linalg.norm(out.clip(0.0), axis=1)
        return np.where(away > 0.0, away, out.max(axis=1))

    def clearance(self, points):
        near = [self._outside(corners, points) for corners in self.boxes]
        return np.minimum.reduce([points[:, 2], *near])

    def zone_margin(self, points):
        near = [self._outside(corners, points) for corners in self.prisms]
        return np.minimum.reduce([self.ceiling - points[:, 2], *near])

    def free(self, spacing=2.0):
        """Free positions of a lattice around the origin, which is one of them but for its z."""
        level = np.arange(-15, 16) * spacing
        grid = np.stack(np.meshgrid(level, level, np.arange(3.0, 50.0, spacing)), -1)
        grid = grid.reshape(-1, 3)
        return grid[(self.clearance(grid) >= D_MIN) & (self.zone_margin(grid) >= 0.0)]


def ring(half, height, hole=2.0):
    """Four boxes around a shaft: a house with a courtyard, half its width and half the shaft's."""
    z = (0.0, height)
    return [
        box((-half, -hole), (-half, half), z),
        box((hole, half), (-half, half), z),
        box((-hole, hole), (-half, -hole), z),
        box((-hole, hole), (hole, half), z),
    ]


@dataclass(frozen=True)
class Case:
    """Samples in a small range, with one truth for all of them."""

    reason: str
    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float] = (0.0, 0.0)
    normal: tuple[float, float, float] = UP
    place: Place = field(default_factory=Place)
    camera: Camera = CAMERA
    reach: float = 30.0
    positions: tuple = ()

    def samples(self):
        low, high = np.transpose([self.x, self.y, self.z])
        xyz = np.random.default_rng(A_CASE).uniform(low, high, (A_CASE, 3))
        one = np.ones(A_CASE)
        return ScoredSamples(xyz, [self.normal] * A_CASE, one * 0, 1.0, one, one, one)


TALL = box((-40, 0), (-40, 40), (0, 30))
EAVES = Place([box((-20, 0), (-20, 20), (0, 12)), box((-20, 2), (-20, 20), (12, 13))])
ALLEY = Place([TALL, box((4, 40), (-40, 40), (0, 30))])
CASES = {
    "open ground": Case("covered", (-4, 4), (-4, 4)),
    "flat roof": Case(
        *("covered", (-8, 8), (-8, 8), (12, 12)), place=Place([box((-9, 9), (-9, 9), (0, 12))])
    ),
    "wall": Case("covered", (0, 0), (-9, 9), (4, 20), EAST, Place([TALL])),
    "floor of a wide courtyard": Case(
        "covered", (-1.5, 1.5), (-1.5, 1.5), place=Place(ring(20, 15, hole=6.0))
    ),
    # free places beside the house are within range, but behind walls; above it is too far
    "floor of a narrow courtyard": Case(
        "occluded", (-1.5, 1.5), (-1.5, 1.5), place=Place(ring(8, 25))
    ),
    # the house is so wide that nothing free is within range at all
    "floor of a courtyard deep inside": Case(
        "no-free-position", (-1.5, 1.5), (-1.5, 1.5), place=Place(ring(40, 25))
    ),
    # seen from above, 19 m away; places that are near enough are all behind walls
    "floor of a courtyard seen too coarsely": Case(
        "gsd", (-0.8, 0.8), (-0.8, 0.8), place=Place(ring(5, 16)), reach=18.0
    ),
    # seen from straight above only, where the gimbal does not look
    "floor of a shaft below the gimbal's range": Case(
        *("gimbal", (-0.8, 0.8), (-0.8, 0.8)), place=Place(ring(8, 16)), camera=SHALLOW
    ),
    "wall below the eaves": Case("covered", (0, 0), (-9, 9), (9, 11), EAST, EAVES),
    # seen only from below, at 20 degrees or more above the horizon
    "eaves from below": Case("gimbal", (0.8, 1.8), (-9, 9), (12, 12), DOWN, EAVES, LOWERED),
    # seen from beside, between 43 and 70 degrees off the vertical
    "under a high bridge": Case(
        *("covered", (-9, 9), (-0.5, 0.5)), place=Place([box((-40, 40), (-6, 6), (7, 8))])
    ),
    # the edge of the deck is 75 degrees off the vertical
    "under a low bridge": Case(
        *("occluded", (-9, 9), (-1.5, 1.5)), place=Place([box((-40, 40), (-9, 9), (2, 3))])
    ),
    "wall behind a no-fly prism": Case(
        *("zone", (0, 0), (-9, 9), (4, 20), EAST),
        place=Place([TALL], [box((0.5, 60), (-60, 60), (-1, 60))]),
    ),
    "under too low a ceiling": Case("zone", (-4, 4), (-4, 4), place=Place(ceiling=2.0)),
    # 4 m from the house opposite; above the roofs it is more than 22 m
    "wall of an alley": Case("no-free-position", (0, 0), (-9, 9), (2, 10), EAST, ALLEY),
    # now within 22 m of places above the roof opposite, whose edge is in between
    "wall of an alley, higher up": Case("occluded", (0, 0), (-9, 9), (14, 18), EAST, ALLEY),
    "seen from two places": Case(
        "too-few-views", (-2, 2), (-2, 2), positions=((-4.0, 0.0, 12.0), (4.0, 0.0, 12.0))
    ),
    "seen from one side": Case(
        *("parallax", (-1, 1), (-1, 1)),
        positions=((0.0, 0.0, 12.0), (0.1, 0.0, 12.0), (0.0, 0.1, 12.0)),
    ),
}


def test_there_are_two_hundred_samples_and_every_reason_is_among_them():
    assert len(CASES) * A_CASE >= 200
    assert {case.reason for case in CASES.values()} == set(REASONS)


@pytest.mark.parametrize("name", CASES)
def test_every_sample_has_the_reason_that_it_was_made_with(name):
    case = CASES[name]
    place = case.place
    positions = np.array(case.positions) if case.positions else place.free()
    got = select_viewpoints(
        *(positions, mesh_of(place.boxes), case.samples(), case.camera),
        settings=ViewpointSettings(objective="hits", connected=False),
        d_min=D_MIN,
        d_max=D_MAX,
        gsd=case.reach / case.camera.focal_px,
        voxel=2.0,
        airspace=place,
    )
    assert [got.reasons[code] for code in got.reason] == [case.reason] * A_CASE
    assert got.reason_counts()[case.reason] == A_CASE


def test_the_overview_has_a_mark_for_every_reason():
    assert set(REASON_MARKS) == set(REASONS) - {"covered"}
    assert len(set(REASON_MARKS.values())) == len(REASON_MARKS)


def assessed(positions, target=4.0, sharp=2):
    """Roof sample photographed straight on from so many places, so many sharp ones possible."""
    positions = np.array(positions, dtype=float)
    one = np.ones(1)
    sample = ScoredSamples(np.zeros((1, 3)), [UP], [0], 1.0, one, one, one)
    yaw, pitch = yaw_pitch(-positions)
    views = Viewpoints(positions, yaw, pitch, ("x",) * len(yaw), np.zeros(len(yaw)))
    demand = Demand(np.array([2]), np.array([0]))
    possible = Demand(np.array([min(2, sharp)]), np.array([0]))
    stages = np.full((4, 1), 9, dtype=np.int32)
    stages[3] = sharp
    return assess(
        *(views, sample, RayCaster(mesh_of([])), CAMERA),
        SightRule(D_MIN, D_MAX, np.radians(70.0), reach=30.0),
        wish=Wish(demand, possible, stages, True, PairWish(target, 1.0, one > 0)),
    )


def judged(positions):
    got = assessed(positions)
    return got.reasons[got.reason[0]]


def around(count, tilt_deg, distance=12.0):
    turn, tilt = np.arange(count) * 2 * np.pi / count, np.radians(tilt_deg)
    level = np.sin(tilt)
    rays = [level * np.cos(turn), level * np.sin(turn), np.full(count, np.cos(tilt))]
    return distance * np.column_stack(rays)


def test_pairs_lack_views_or_parallax():
    assert judged(around(12, 12.0)) == "covered"
    assert judged(around(3, 12.0)) == "too-few-views"  # three pairs are worth less than 3
    assert judged(around(12, 0.5)) == "parallax"  # 66 pairs, none over a degree
    assert judged(around(1, 0.0)) == "too-few-views"


def test_what_cannot_be_seen_sharply_still_has_to_reach_the_target():
    """From afar only, where no photo is within the GSD, twelve photos do and three do not."""
    for count, share in ((12, 1.0), (3, 0.0)):
        got = assessed(around(count, 12.0, distance=31.0), target=2.0, sharp=0)
        assert got.hits[0] == 0
        assert got.reasons[got.reason[0]] == "gsd"
        assert got.fulfilled == share
        assert any(finding.partial for finding in got.findings) == (share < 1.0)
