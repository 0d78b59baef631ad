"""Prisms and ceilings: by hand, by property, and against another point-in-polygon test."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.path import Path as Outline

from planner.airspace.zones import Prism, Zones, ceiling_over, signed_distance_to_polygon, zones
from planner.config import ZoneSettings
from planner.scene.scene import Ground

SQUARE = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])
NOTCHED = np.array([[0.0, 0], [10, 0], [10, 10], [5, 4], [0, 10]])
LEVEL = Ground(np.full((3, 3), 2.0), np.zeros(2), 10.0)


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((5, 5, 5), -3.0),  # nearest way out is up
        ((1, 5, 5), -1.0),  # ... through the side
        ((-2, 5, 5), 2.0),
        ((5, 5, 10), 2.0),
        ((5, 5, 1), 1.0),  # under it
        ((13, 14, 5), 5.0),  # off an upright edge
        ((13, 14, 20), 13.0),  # off a corner: 3, 4, 12
        ((10, 5, 5), 0.0),
    ],
)
@pytest.mark.parametrize("kind", ["keep_out", "keep_in"])
def test_a_square_prism_has_the_margins_worked_out_by_hand(kind, point, expected):
    margin = Prism(kind, SQUARE, 2.0, 8.0).margin(np.array([point], dtype=float))
    np.testing.assert_allclose(margin, [expected if kind == "keep_out" else -expected], atol=1e-12)


def test_open_ends_reach_to_infinity():
    prism = Prism("keep_out", SQUARE)
    np.testing.assert_allclose(prism.margin(np.array([[5, 5, 1e6], [5, 2, -1e6]])), [-5, -2])


@pytest.mark.parametrize(
    ("xy", "expected"),
    [((5, 7), np.sqrt(6.25 / 2.44)), ((5, 3), -1.0), ((5, 5), 5 / np.sqrt(61)), ((1, 5), -1.0)],
)
def test_a_notch_is_outside(xy, expected):
    got = signed_distance_to_polygon(np.array([xy], dtype=float), NOTCHED)[0]
    if xy == (5, 7):  # straight to the slope from (5, 4) to (10, 10): height over base of triangle
        expected = 3 * 5 / np.sqrt(61)
    np.testing.assert_allclose(got, expected, atol=1e-12)


def random_outline(rng, count):
    angle = np.sort(rng.uniform(0, 2 * np.pi, count))
    return np.column_stack([np.cos(angle), np.sin(angle)]) * rng.uniform(2, 9, (count, 1))


def random_zones(rng):
    prisms = [
        Prism(
            "keep_out" if rng.random() < 0.5 else "keep_in",
            random_outline(rng, rng.integers(3, 9)),
            rng.choice([-np.inf, rng.uniform(-5, 0)]),
            rng.choice([np.inf, rng.uniform(1, 9)]),
        )
        for _ in range(rng.integers(0, 4))
    ]
    heights = rng.normal(0, rng.choice([0, 1, 8]), (7, 5))
    ground = Ground(heights, rng.uniform(-9, -5, 2), 2.0)
    ceiling = ceiling_over(ground, 12.0) if rng.random() < 0.7 else None
    return Zones(tuple(prisms), ceiling), ground


seeds = st.integers(0, 2**31)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_inside_is_where_another_library_says_it_is(seed):
    rng = np.random.default_rng(seed)
    outline = random_outline(rng, rng.integers(3, 12))
    xy = rng.uniform(-10, 10, (300, 2))
    margin = signed_distance_to_polygon(xy, outline)
    sure = np.abs(margin) > 1e-9
    inside = Outline(outline).contains_points(xy)
    np.testing.assert_array_equal((margin < 0)[sure], inside[sure])
    np.testing.assert_allclose(margin, signed_distance_to_polygon(xy, outline[::-1]), atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_margins_change_by_at_most_a_metre_a_metre(seed):
    rng = np.random.default_rng(seed)
    space, _ = random_zones(rng)
    a = rng.uniform(-12, 12, (300, 3))
    b = a + rng.normal(size=(300, 3)) * 10 ** rng.uniform(-3, 1, (300, 1))
    with np.errstate(invalid="ignore"):
        change = np.nan_to_num(np.abs(space.margin(a) - space.margin(b)))
    assert (change <= np.linalg.norm(a - b, axis=1) + 1e-9).all()


@settings(max_examples=60, deadline=None)
@given(seeds, st.floats(1.0, 60.0))
def test_nothing_allowed_is_above_the_ceiling(seed, above):
    rng = np.random.default_rng(seed)
    ground = Ground(rng.normal(0, 4, (8, 6)), np.array([-3.0, 2.0]), 1.5)
    ceiling = ceiling_over(ground, above)
    points = rng.uniform((-8, -3, 0), (14, 16, above + 10), (400, 3))
    allowed = ceiling.margin(points) >= 0
    assert (points[allowed, 2] <= ground.height(points[allowed]) + above + 1e-9).all()


def test_over_level_terrain_the_ceiling_is_exact():
    margin = ceiling_over(LEVEL, 30.0).margin(np.array([[5, 5, 30.0], [-50, 80, 33.5]]))
    np.testing.assert_allclose(margin, [2.0, -1.5], atol=1e-12)


def test_next_to_a_cliff_the_lower_ceiling_counts():
    ground = Ground(np.repeat([[0.0], [0.0], [20.0], [20.0], [20.0]], 3, axis=1), np.zeros(2), 10.0)
    ceiling = ceiling_over(ground, 30.0, steepest=0.5)
    at = np.array([[x, 15.0, 0.0] for x in (10, 20, 30, 40, 50)])
    np.testing.assert_allclose(ceiling.height(at), [30, 30, 35, 40, 45])


@settings(max_examples=60, deadline=None)
@given(seeds, st.floats(0.0, 2.0))
def test_a_proven_segment_has_the_margin_everywhere_and_a_refused_one_lacks_it(seed, wanted):
    rng = np.random.default_rng(seed)
    space, _ = random_zones(rng)
    for a, b in zip(*rng.uniform(-15, 15, (2, 10, 3)), strict=True):
        least = space.margin(a + np.linspace(0, 1, 800)[:, None] * (b - a)).min()
        if space.margin_at_least(a, b, wanted):
            assert least >= wanted
        else:
            assert least <= wanted + 0.5 * np.linalg.norm(b - a) / 799 + 2e-3


@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(0.0, 6.0))
def test_what_is_kept_from_zones_is_kept_by_every_point_and_proven_segment(seed, kept):
    rng = np.random.default_rng(seed)
    bare, _ = random_zones(rng)
    space = replace(bare, kept=kept)
    for a, b in zip(*rng.uniform(-15, 15, (2, 10, 3)), strict=True):
        least = bare.margin(a + np.linspace(0, 1, 800)[:, None] * (b - a)).min()
        if space.margin_at_least(a, b, 0.0):
            assert least >= kept - 1e-9
        else:
            assert least <= kept + 0.5 * np.linalg.norm(b - a) / 799 + 2e-3


def test_settings_become_zones():
    keep_in = ZoneSettings(
        kind="keep_in", polygon=((0, 0), (9, 0), (9, 9)), bottom=1.0, name="site"
    )
    space = zones([keep_in], 20.0, LEVEL)
    assert space.prisms[0].name == "site"
    np.testing.assert_allclose(space.margin(np.array([[8.0, 3, 0.5], [8, 3, 23]])), [-0.5, -1.0])
    wide = zones([keep_in], 20.0, LEVEL, kept=0.75)
    np.testing.assert_allclose(wide.margin(np.array([[8.0, 3, 0.5], [8, 3, 23]])), [-1.25, -1.75])
    assert zones([], None, LEVEL).margin(np.zeros((2, 3))).tolist() == [np.inf, np.inf]
    assert zones([], None, LEVEL).margin_at_least(np.zeros(3), np.ones(3), 1e9)


@pytest.mark.parametrize(
    ("polygon", "bottom", "top"),
    [(SQUARE[:2], 0.0, 1.0), (SQUARE, 3.0, 3.0), (SQUARE * np.nan, 0.0, 1.0)],
)
def test_prisms_that_cannot_be_are_refused(polygon, bottom, top):
    with pytest.raises(ValueError, match="three finite corners"):
        Prism("keep_out", polygon, bottom, top)
