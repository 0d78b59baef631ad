"""Photos in between make the view graph one piece."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.scene.cloud import Mesh
from planner.surface.samples import SurfaceSamples
from planner.viewpoints.bridges import _best, connect
from planner.viewpoints.camera import Camera
from planner.viewpoints.graph import LinkRule, link
from planner.viewpoints.rays import RayCaster
from planner.viewpoints.viewpoints import Viewpoints

CAMERA = Camera(width_px=600, height_px=400, focal_px=400.0)
CASTER = RayCaster(Mesh(np.empty((0, 3)), np.empty((0, 3))))
GROUND = np.stack(np.meshgrid(np.arange(120.0), np.arange(20.0), [0.0]), -1).reshape(-1, 3)
FIELD = SurfaceSamples(GROUND, np.tile([0.0, 0.0, 1.0], (2400, 1)), np.zeros(2400), 1.0)
PLACES = np.stack(np.meshgrid(np.arange(0.0, 120.0, 4.0), [6.0, 10.0, 14.0], [12.0]), -1)
PLACES = PLACES.reshape(-1, 3)


def down(x, yaw=0.0):
    count = len(x)
    places = np.column_stack([x, np.full(count, 10.0), np.full(count, 12.0)])
    return Viewpoints(
        places, np.full(count, yaw), np.full(count, -90.0), ("cover",) * count, np.full(count, -1)
    )


def graph_of(views, **rule):
    return link(views, FIELD, CASTER, CAMERA, reference=60.0, links=LinkRule(**rule))


@pytest.mark.parametrize("x", [[8, 28], [8, 108], [8, 12, 60, 64, 112], [60], [4, 8, 12, 100]])
def test_every_gap_is_bridged_and_every_photo_gets_its_links(x):
    views = down(np.array(x, dtype=float))
    got = connect(views, PLACES, FIELD, CASTER, CAMERA, reference=60.0)
    graph = graph_of(got)
    assert graph.components == 1
    assert graph.degree.min() >= min(3, len(got) - 1)
    assert graph.firm
    np.testing.assert_array_equal(got.positions[: len(views)], views.positions)
    assert set(got.kind[len(views) :]) <= {"bridge"}
    spare = got.positions[len(views) :]
    free = {tuple(place) for place in PLACES}
    assert all(tuple(place) in free for place in spare)


def test_a_firm_graph_is_left_alone():
    views = down(np.arange(20.0, 40.0, 4.0))
    assert graph_of(views).firm
    got = connect(views, PLACES, FIELD, CASTER, CAMERA, reference=60.0)
    assert len(got) == len(views)


def test_where_nothing_is_free_it_stays_as_good_as_it_gets():
    views = down(np.array([8.0, 108.0]))
    got = connect(views, views.positions, FIELD, CASTER, CAMERA, reference=60.0)
    assert len(got) == 2
    none = connect(views, np.empty((0, 3)), FIELD, CASTER, CAMERA, reference=60.0)
    assert len(none) == 2


def test_a_stricter_rule_asks_for_more_photos():
    views = down(np.array([8.0, 108.0]))
    strict = LinkRule(shared_share=0.7)
    got = connect(views, PLACES, FIELD, CASTER, CAMERA, reference=60.0, links=strict)
    assert graph_of(got, shared_share=0.7).firm
    usual = connect(views, PLACES, FIELD, CASTER, CAMERA, reference=60.0)
    assert len(got) > len(usual)


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=40)
def test_the_best_photo_joins_most_pieces_then_helps_most_photos(seed):
    rng = np.random.default_rng(seed)
    linked = rng.random((24, 24)) < rng.choice([0.02, 0.1, 0.3])
    linked |= linked.T
    there, part = rng.random(24) < 0.6, rng.integers(0, 4, 24)
    lacking = there & (rng.random(24) < 0.5)
    best, most = -1, (0, 0, 0)
    for row in np.flatnonzero(~there):
        friends = linked[row] & there
        joins = max(0, len(set(part[friends])) - 1)
        worth = (joins, int((friends & lacking).sum()), int(friends.sum()))
        if worth[0] + worth[1] > 0 and worth > most:
            best, most = row, worth
    assert _best(linked, there, part, lacking) == best
