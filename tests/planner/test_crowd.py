"""Photos that are moved: every worth against fresh rays and plain sums."""

import math

import hypothesis
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.scene.cloud import Mesh
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.camera import Camera
from planner.viewpoints.candidates import aim_directions
from planner.viewpoints.crowd import Crowd
from planner.viewpoints.eye import Eye
from planner.viewpoints.free_balls import FreeBalls
from planner.viewpoints.moves import Wish, _look
from planner.viewpoints.pool import Pool
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.reconstructability import GRAZING, reconstructability
from planner.viewpoints.sight import SightRule
from planner.viewpoints.viewpoints import Viewpoints

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
REFERENCE, DIRECTIONS = 40.0, 30
SHARP = SightRule(3.0, 20.0, math.radians(70.0), reach=20.0)
WIDE = SightRule(0.0, REFERENCE, GRAZING, sectors=1)


def scene():
    """A floor of 16 x 12 m with a wall of 6 m across it."""
    floor = [[-8, -6, 0], [8, -6, 0], [8, 6, 0], [-8, 6, 0]]
    wall = [[0, -6, 0], [0, 6, 0], [0, 6, 6], [0, -6, 6]]
    mesh = Mesh(np.array([*floor, *wall], float), [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    x, y, z = np.arange(-7.0, 7.1, 2.0), np.arange(-5.0, 5.1, 2.0), np.arange(1.0, 5.1, 2.0)
    ground = np.stack(np.meshgrid(x, y, [0.0]), -1).reshape(-1, 3)
    sides = np.stack(np.meshgrid([0.0], y, z), -1).reshape(-1, 3)
    xyz = np.concatenate([ground, sides])
    normals = np.repeat([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], [len(ground), len(sides)], axis=0)
    return mesh, SurfaceSamples(xyz, normals, np.zeros(len(xyz)), 2.0)


MESH, SAMPLES = scene()
CASTER = RayCaster(MESH)
EYE = Eye(SAMPLES, CASTER, WIDE, REFERENCE)
SPACE = FreeBalls(np.array([[0.0, 0.0, 30.0]]), np.array([22.0]))


def crowd(seed, count=7, **changes):
    rng = np.random.default_rng(seed)
    places = SPACE.nearest(rng.uniform((-12, -10, 6), (12, 10, 20), (count, 3)))
    yaw, pitch = aim_directions(DIRECTIONS, CAMERA)
    aim = rng.integers(0, DIRECTIONS, count)
    given = {"want": np.full(len(SAMPLES), 2), "sharp_worth": 0.75, "sharp": SHARP}
    wish = Wish(rng.uniform(1.0, 3.0, len(SAMPLES)), **(given | changes))
    options = {"eye": EYE, "space": SPACE, "camera": CAMERA, "directions": DIRECTIONS}
    return wish, Crowd(places, yaw[aim], pitch[aim], wish=wish, **options)


def worth(wish, positions, yaw, pitch):
    """Sum over the samples by fresh rays and the exact formula."""
    count = len(positions)
    views = Viewpoints(positions, yaw, pitch, ("x",) * count, np.full(count, -1))
    h = reconstructability(views, SAMPLES, CASTER, CAMERA, reference=REFERENCE)
    options = {"samples": SAMPLES, "caster": CASTER, "camera": CAMERA}
    seen = Pool.at(positions, yaw, pitch, rule=wish.sharp or WIDE, **options)
    return wish.worth(h, np.bincount(seen.sample, minlength=len(SAMPLES))).sum()


@given(st.integers(0, 10_000))
@hypothesis.settings(max_examples=15, deadline=None)
def test_what_a_job_says_of_a_photo_is_what_is_lost_and_won_by_moving_it(seed):
    wish, photos = crowd(seed)
    poses = photos.positions, photos.yaw_deg, photos.pitch_deg
    (job,) = photos._jobs(np.array([2]), step=1.0, evaluations=4)
    rest = [np.delete(part, 2, axis=0) for part in poses]
    assert job.worth[0] == pytest.approx(worth(wish, *poses) - worth(wish, *rest), abs=0.02)
    spot = SPACE.nearest(np.random.default_rng(seed).uniform(-10, 20, (1, 3)))
    (aim,), (value,) = _look(job, spot, np.zeros(1, dtype=np.int64))
    yaw, pitch = aim_directions(DIRECTIONS, CAMERA)
    there = [
        np.concatenate([part, new])
        for part, new in zip(rest, (spot, [yaw[aim]], [pitch[aim]]), strict=True)
    ]
    assert value == pytest.approx(worth(wish, *there) - worth(wish, *rest), abs=0.02)


@given(st.integers(0, 10_000), st.booleans())
@hypothesis.settings(max_examples=10, deadline=None)
def test_moving_makes_photos_worth_more_and_keeps_account(seed, sharp):
    changes = {} if sharp else {"want": np.zeros(len(SAMPLES), dtype=np.int64), "sharp": None}
    wish, photos = crowd(seed, **changes)
    before = worth(wish, photos.positions, photos.yaw_deg, photos.pitch_deg)
    moved = photos.move(step=3.0, evaluations=8)
    after = worth(wish, photos.positions, photos.yaw_deg, photos.pitch_deg)
    assert after > before if moved else after == before
    photos._album()
    told = wish.worth(photos._value, photos._sharp).sum()
    assert told == pytest.approx(after, abs=0.05)
    away = np.linalg.norm(photos.positions - SPACE.centres, axis=1)
    assert away.max() <= SPACE.radii[0] + 1e-9


def test_a_worth_by_hand():
    wish = Wish(np.array([4.0, 4.0, 2.0]), np.array([1, 1, 0]), sharp_worth=1.0)
    got = wish.worth(np.array([5.0, 5.0, 3.0]), np.array([2, 0, 1]))
    np.testing.assert_array_equal(got, [4.0 + 1.0, 4.0, 2.0])
    hungry = wish.hungry(np.array([5.0, 5.0, 1.0]), np.array([2, 0, 1]))
    np.testing.assert_array_equal(hungry, [False, True, True])
