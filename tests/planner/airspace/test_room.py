"""Zones that change nothing, and the number that is missing where nothing is free."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.airspace.airspace import build_airspace
from planner.airspace.room import idle_zones, lack_of_room, roomiest
from planner.config import AirspaceSettings, ZoneSettings
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground
from planner.scene.synthetic import synthetic_scene


def rectangle(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


@pytest.fixture(scope="module")
def place():
    return synthetic_scene(
        3,
        size=(44.0, 44.0),
        buildings=2,
        heights=(6.0, 9.0),
        spacing=1.5,
        trees=False,
        bridge=False,
    )


def airspace(place, *, d_min=3.0, **zones):
    flat = Mesh(np.array([[-1.0, -1, 5], [1, -1, 5], [0, 1, 5]]), np.array([[0, 1, 2]]))
    return build_airspace(
        place, flat, d_min=d_min, d_max=10 * d_min, settings=AirspaceSettings(**zones)
    )


@pytest.mark.parametrize(
    ("shape", "top", "away"),
    [
        (rectangle(200, 0, 210, 10), None, 200.0),  # beside
        (rectangle(-5, -5, 5, 5), None, 0.0),  # inside
        (rectangle(-500, -1, 500, 1), None, 0.0),  # only its edges meet the box
        (rectangle(-500, -500, 500, 500), None, 0.0),  # around all of it
        (rectangle(-5, -5, 5, 5), -100.0, 100.0),  # under it
    ],
)
def test_a_zone_that_meets_nothing_is_found_with_its_distance(place, shape, top, away):
    space = airspace(place, zones=(ZoneSettings(polygon=shape, top=top, name="airport"),))
    found = idle_zones(space)
    if away == 0.0:
        assert found == ()
        return
    (finding,) = found
    edge = space.high[0] if top is None else -space.low[2]
    assert finding.number == pytest.approx(away - edge)
    assert "airport" in finding.message
    assert not finding.partial


def test_a_geofence_elsewhere_is_named_with_its_distance(place):
    fence = ZoneSettings(kind="keep_in", polygon=rectangle(300, 0, 400, 90), name="site")
    space = airspace(place, zones=(fence,))
    assert f"{300 - space.high[0]:.1f} m away" in lack_of_room(space)
    assert "site" in lack_of_room(space)


def test_a_ceiling_under_d_min_says_by_how_much_to_raise_it(place):
    level = replace(place, ground=Ground(np.zeros((4, 4)), np.full(2, -50.0), 25.0))
    space = airspace(level, ceiling=2.0)
    assert roomiest(space).spare < 0.0
    lack = lack_of_room(space)
    assert lack.startswith(
        "airspace.ceiling 2 m is under d_min; raise it by over 1.00 m, and by sc"
    )


def sloped(place, rise=0.2):
    """The place on ground that rises from west to east."""
    heights = np.repeat(rise * 10.0 * np.arange(11.0)[:, None], 11, axis=1)
    return replace(place, ground=Ground(heights, np.full(2, -55.0), 10.0))


def test_a_ceiling_above_all_that_flight_considers_is_found_with_its_height(place):
    level = replace(place, ground=Ground(np.zeros((4, 4)), np.full(2, -50.0), 25.0))
    top = airspace(level).high[2]
    (finding,) = idle_zones(airspace(level, ceiling=top + 70.0))
    assert finding.code == "ceiling-meets-nothing"
    assert finding.number == pytest.approx(70.0)
    assert "70.0 m above all places" in finding.message
    assert not finding.partial
    assert idle_zones(airspace(level, ceiling=top - 0.1)) == ()


@settings(max_examples=30, deadline=None)
@given(above=st.floats(10.0, 120.0))
def test_a_ceiling_is_idle_exactly_where_it_forbids_nothing(place, above):
    """Over a slope: what is said agrees with many places under the top of the space."""
    space = airspace(sloped(place), ceiling=above)
    low, high = space.bounds
    rim = [np.linspace(a, b, 60) for a, b in zip(low[:2], high[:2], strict=True)]
    top = np.stack(np.meshgrid(*rim, [high[2]], indexing="ij"), axis=-1).reshape(-1, 3)
    over = (space.zones.ceiling.height(top) - high[2]).min()
    found = idle_zones(space)
    assert bool(found) == (over > 0.0)
    for finding in found:
        assert finding.number == pytest.approx(over)


def test_a_ceiling_over_d_min_that_forbids_all_says_by_how_much_to_raise_it(place):
    """Terrain that is too steep for the ceiling to follow: the lower side's counts."""
    steep = sloped(place, rise=1.5)
    space = airspace(steep, ceiling=3.1)
    message = lack_of_room(space, margin=0.1)
    assert message.startswith("airspace.ceiling 3.1 m forbids all; raise it by over ")
    lack = float(message.split(" m, and by scale.voxel")[0].split()[-1])
    assert roomiest(airspace(steep, ceiling=3.1 + lack + 0.01)).spare >= 0.1


def test_everything_forbidden_is_said_with_what_is_missing(place):
    everywhere = ZoneSettings(polygon=rectangle(-500, -500, 500, 500))
    space = airspace(place, zones=(everywhere,))
    room = roomiest(space)
    assert room.spare == pytest.approx(room.spare_of_zones)
    assert f"lacks {-room.spare:.2f} m" in lack_of_room(space)


def test_what_only_its_margin_reaches_is_no_idle_zone(place):
    beside = airspace(place).high[0] + 3.0
    zone = ZoneSettings(polygon=rectangle(beside, 0, beside + 10, 10))
    assert len(idle_zones(airspace(place, zones=(zone,), zone_margin=2.9))) == 1
    assert idle_zones(airspace(place, zones=(zone,), zone_margin=3.1)) == ()
    level = replace(place, ground=Ground(np.zeros((4, 4)), np.full(2, -50.0), 25.0))
    top = airspace(level).high[2]
    assert len(idle_zones(airspace(level, ceiling=top + 3.0, zone_margin=2.9))) == 1
    assert idle_zones(airspace(level, ceiling=top + 3.0, zone_margin=3.1)) == ()


def test_a_margin_of_zones_that_takes_all_room_is_named(place):
    fence = ZoneSettings(kind="keep_in", polygon=rectangle(-30, -30, 30, 30))
    space = airspace(place, zones=(fence,), zone_margin=40.0)
    assert lack_of_room(space).endswith(", from which airspace.zone_margin keeps 40 m")
    level = replace(place, ground=Ground(np.zeros((4, 4)), np.full(2, -50.0), 25.0))
    under = lack_of_room(airspace(level, ceiling=2.0, zone_margin=4.0))
    assert under.startswith("airspace.ceiling 2 m is under d_min; raise it by over 5.00 m, ")
    over = lack_of_room(airspace(level, ceiling=5.0, zone_margin=4.0), margin=0.0)
    assert over.startswith("airspace.ceiling 5 m forbids all; raise it by over 2.")


def test_room_that_only_the_margin_takes_is_named(place):
    space = airspace(place)
    margin = roomiest(space).spare + 1.0
    assert f"where flight.margin keeps {margin:g} m" in lack_of_room(space, margin=margin)


def test_room_too_narrow_for_the_grid_is_told_from_room_far_away(place):
    level = replace(place, ground=Ground(np.zeros((4, 4)), np.full(2, -50.0), 25.0))
    narrow = lack_of_room(airspace(level, ceiling=3.5), margin=0.0)
    assert narrow.endswith("lower scale.voxel or raise airspace.ceiling")
    everywhere_near = ZoneSettings(polygon=rectangle(-90, -90, 90, 90))
    far = lack_of_room(airspace(place, zones=(everywhere_near,), beyond=150.0), margin=0.0)
    assert far.endswith("is too far from the scene")
