"""Zones that change nothing, and the number that is missing where nothing is free."""

import numpy as np
import pytest

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


def airspace(place, *, d_min=3.0, **settings):
    flat = Mesh(np.array([[-1.0, -1, 5], [1, -1, 5], [0, 1, 5]]), np.array([[0, 1, 2]]))
    return build_airspace(
        place, flat, d_min=d_min, d_max=10 * d_min, settings=AirspaceSettings(**settings)
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
    level = type(place)(
        **{
            **{name: getattr(place, name) for name in place.__dataclass_fields__},
            "ground": Ground(np.zeros((4, 4)), np.full(2, -50.0), 25.0),
        }
    )
    space = airspace(level, ceiling=2.0)
    assert roomiest(space).spare < 0.0
    assert lack_of_room(space) == "airspace.ceiling 2 m is under d_min; raise it by over 1.00 m"


def test_everything_forbidden_is_said_with_what_is_missing(place):
    everywhere = ZoneSettings(polygon=rectangle(-500, -500, 500, 500))
    space = airspace(place, zones=(everywhere,))
    room = roomiest(space)
    assert room.spare == pytest.approx(room.spare_of_zones)
    assert f"lacks {-room.spare:.2f} m" in lack_of_room(space)


def test_room_that_only_the_margin_takes_is_named(place):
    space = airspace(place)
    margin = roomiest(space).spare + 1.0
    assert f"where flight.margin keeps {margin:g} m" in lack_of_room(space, margin=margin)
