"""Every solid of the made-up town is closed, faces outwards and stays in its room."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.scene.cloud import Mesh
from planner.scene.town import styles
from planner.scene.town.building import Kind, Site
from planner.scene.town.inside import inside
from planner.scene.town.layout import SMALLEST_SIDE, lay_out
from planner.scene.town.solids import Footprint, box, gabled, loft, polygon, ring, slanted
from planner.scene.town.terrain import random_relief, sheet

SQUARE = Footprint(1.0, -2.0, 3.0, 2.0, 0.3)
STYLES = (
    styles.house,
    styles.terrace,
    styles.flats,
    styles.setback,
    styles.tower,
    styles.courtyard,
    styles.cantilever,
    styles.wings,
    styles.church,
)


def as_trimesh(solid):
    return trimesh.Trimesh(solid.vertices, solid.triangles, process=False)


def assert_closed_and_outward(solid):
    mesh = as_trimesh(solid)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0.0
    assert mesh.area_faces.min() > 1e-6


@pytest.mark.parametrize(
    ("solid", "volume"),
    [
        (box(SQUARE, 1.0, 3.5), 6 * 4 * 2.5),
        (slanted(SQUARE, 0.0, 3.0, 5.0), 6 * 4 * 4.0),
        (gabled(SQUARE, 0.0, 3.0, 5.0), 6 * 4 * 3.0 + 6 * 4 * 2.0 / 2),
        (gabled(SQUARE, 3.0, 3.0, 5.0), 6 * 4 * 2.0 / 2),
        (gabled(SQUARE, 0.0, 3.0, 5.0, hip=1.5), 72.0 + 3 * 4 * 2.0 / 2 + 2 * 1.5 * 4 * 2.0 / 3),
        (ring(SQUARE.corners(), SQUARE.inset(1.0).corners(), 0.0, 2.0), (24 - 8) * 2.0),
        (
            ring(SQUARE.corners(), SQUARE.inset(1.0).corners(), 0.0, 2.0, ridge=3.0),
            # roof: triangle of 1 m x 1 m along the middle line between the outlines
            32.0 + 0.5 * 2 * (5 + 3),
        ),
        (loft([polygon(0, 0, 2.0, 4)] * 2, [0.0, 3.0]), 8 * 3.0),
        (loft([polygon(0, 0, 2.0, 4)], [0.0], apex=np.array([[0, 0, 3.0]])), 8.0),
    ],
)
def test_volumes_match_hand_worked_values(solid, volume):
    assert_closed_and_outward(solid)
    assert as_trimesh(solid).volume == pytest.approx(volume, rel=1e-12)


@settings(max_examples=150, deadline=None)
@given(
    style=st.sampled_from(STYLES),
    seed=st.integers(0, 2**32),
    half=st.tuples(st.floats(SMALLEST_SIDE / 2, 24), st.floats(SMALLEST_SIDE / 2, 24)),
    turn=st.floats(-3.0, 3.0),
    height=st.floats(3.0, 60.0),
)
def test_every_style_is_closed_and_keeps_its_room_and_height(style, seed, half, turn, height):
    attached = bool(seed % 2)
    room = Footprint(10.0, -5.0, *half, turn)
    site = Site(room, bottom=-1.5, ground=0.5, height=height, attached=attached)
    built = style(site, np.random.default_rng(seed))
    for solid, kind in built.parts:
        assert kind in (Kind.BUILDING, Kind.BALCONY)
        assert_closed_and_outward(solid)
    vertices = np.concatenate([solid.vertices for solid, _ in built.parts])
    c, s = np.cos(turn), np.sin(turn)
    own = (vertices[:, :2] - [room.x, room.y]) @ np.array([[c, -s], [s, c]])
    assert (np.abs(own) <= np.array(half) + 1e-9).all()
    assert vertices[:, 2].max() == pytest.approx(0.5 + height)
    assert vertices[:, 2].min() == pytest.approx(-1.5)


def overlap(a, b):
    return min(a.x1, b.x1) - max(a.x0, b.x0) > 1e-9 and min(a.y1, b.y1) - max(a.y0, b.y0) > 1e-9


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    size=st.tuples(st.floats(40, 300), st.floats(40, 300)),
    buildings=st.integers(1, 8),
)
def test_parcels_and_streets_tile_the_place_without_overlap(seed, size, buildings):
    layout = lay_out(size, buildings, np.random.default_rng(seed))
    rects = [parcel.rect for parcel in layout.parcels] + list(layout.streets)
    assert sum(not parcel.park for parcel in layout.parcels) == buildings
    for i, a in enumerate(rects):
        assert abs(a.x0) <= size[0] / 2 - 4.0 + 1e-9
        assert abs(a.y1) <= size[1] / 2 - 4.0 + 1e-9
        assert a.short >= SMALLEST_SIDE - 1e-9
        assert not any(overlap(a, b) for b in rects[:i])


def test_too_many_buildings_are_refused_with_both_numbers():
    with pytest.raises(ValueError, match=r"200 buildings do not fit on 50 x 40 m"):
        lay_out((50, 40), 200, np.random.default_rng(0))


def test_a_ground_sheet_has_lines_along_every_mark_and_faces_up():
    rng = np.random.default_rng(3)
    mark = np.array([[-3.3, 1.7], [4.1, 9.2]])
    solid, kinds = sheet((50.0, 40.0), random_relief(2.0, rng), [(mark, Kind.STREET)])
    mesh = as_trimesh(solid)
    assert (mesh.face_normals[:, 2] > 0.9).all()
    assert np.ptp(solid.vertices[:, :2], axis=0) == pytest.approx([50.0, 40.0])
    flat = trimesh.Trimesh(solid.vertices * [1, 1, 0], solid.triangles, process=False)
    assert flat.area == pytest.approx(50.0 * 40.0)
    assert flat.area_faces[kinds == Kind.STREET].sum() == pytest.approx(7.4 * 7.5)


def test_inside_counts_overlapping_solids_and_the_soil():
    floor, _ = sheet((40.0, 40.0), random_relief(0.0, np.random.default_rng(0)), [])
    parts = [
        floor,
        box(Footprint(0, 0, 4, 4), -1.0, 6.0),
        box(Footprint(3, 0, 4, 4), -1.0, 4.0),  # overlaps the first
        box(Footprint(0, 12, 3, 1), 5.0, 5.5),  # a deck in the air
    ]
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    mesh = Mesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.triangles + at for part, at in zip(parts, first, strict=False)]),
    )
    points = np.array(
        [
            [0.1, 0.2, 3.0],  # in the first alone
            [2.0, 0.2, 3.0],  # in both
            [6.0, 0.3, 3.9],  # in the second alone
            [6.0, 0.3, 4.1],  # above the second
            [0.3, 12.1, 5.2],  # in the deck
            [0.3, 12.1, 2.0],  # under the deck
            [0.3, 12.1, 5.6],  # on the deck
            [15.0, 15.0, -0.1],  # in the soil
            [2.0, 0.2, -0.5],  # in the soil and in both foundations
            [15.0, 15.0, 0.1],
        ]
    )
    assert inside(mesh, points).tolist() == [True] * 3 + [False, True] + [False] * 2 + [
        True,
        True,
        False,
    ]
