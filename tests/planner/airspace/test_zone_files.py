"""Zones from the world into the local frame, worked out a second way; what is refused."""

import json

import numpy as np
import pytest

from planner.airspace.zone_files import local_zones, read_geojson
from planner.config import AirspaceSettings, ZoneSettings
from planner.errors import PlannerError
from planner.geometry.frames import Frame
from planner.scene.cloud import PointCloud
from planner.scene.scene import Box, Ground, Scene

ORIGIN = np.array([565_000.0, 5_930_000.0, 20.0])
SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))


def scene(crs="EPSG:25832", *, origin=ORIGIN, unit=1.0):
    heights = np.array([[1.0, 1.0], [2.0, 4.0]])
    return Scene(
        name="here",
        cloud=PointCloud(np.zeros((1, 3))),
        mesh=None,
        ground=Ground(heights, np.zeros(2), 10.0),
        box=Box(np.zeros(3), np.eye(3), np.full(3, 40.0)),
        frame=Frame(origin, crs, unit_metres=unit),
    )


def in_the_world(corners, crs="EPSG:25832"):
    """Longitude and latitude of local corners."""
    from pyproj import Transformer

    back = Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    return [list(back.transform(x + ORIGIN[0], y + ORIGIN[1])) for x, y in corners]


def written(folder, geometry, **properties):
    path = folder / "zones.geojson"
    feature = {"type": "Feature", "geometry": geometry, "properties": properties}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    return path


def polygon(corners=SQUARE):
    ring = in_the_world(corners)
    return {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}


def test_a_geojson_polygon_comes_to_lie_where_it_is(tmp_path):
    path = written(tmp_path, polygon(), name="mast", bottom=0, top=30, colour="red")
    settings = local_zones(AirspaceSettings(zone_files=(str(path),)), scene())
    (zone,) = settings.zones
    np.testing.assert_allclose(zone.polygon, SQUARE, atol=1e-3)
    assert (zone.kind, zone.name, zone.crs, zone.heights) == ("keep_out", "mast", "local", "local")
    assert settings.zone_files == ()
    assert local_zones(settings, scene()) == settings


@pytest.mark.parametrize(
    ("kind", "expected"), [("keep_out", (1.0, 34.0)), ("keep_in", (4.0, 31.0))]
)
def test_heights_above_sloping_ground_forbid_rather_too_much(tmp_path, kind, expected):
    corners = ((1.0, 1.0), (19.0, 1.0), (19.0, 19.0))  # over ground of 1 to 4 m
    path = written(tmp_path, polygon(corners), kind=kind, bottom=0.0, top=30.0)
    (zone,) = local_zones(AirspaceSettings(zone_files=(str(path),)), scene()).zones
    assert (zone.bottom, zone.top) == expected


@pytest.mark.parametrize("unit", [1.0, 0.3048])
def test_coordinates_of_the_source_lose_its_origin(unit):
    corners = tuple(((x + ORIGIN[0]) / unit, (y + ORIGIN[1]) / unit) for x, y in SQUARE)
    given = ZoneSettings(polygon=corners, crs="source", heights="source", bottom=25.0)
    (zone,) = local_zones(AirspaceSettings(zones=(given,)), scene(unit=unit)).zones
    np.testing.assert_allclose(zone.polygon, SQUARE, atol=1e-6)
    assert (zone.bottom, zone.top) == (5.0, None)


def test_another_map_projection_is_understood():
    from pyproj import Transformer

    to_gauss = Transformer.from_crs("EPSG:25832", "EPSG:31467", always_xy=True)
    corners = tuple(to_gauss.transform(x + ORIGIN[0], y + ORIGIN[1]) for x, y in SQUARE)
    given = ZoneSettings(polygon=corners, crs="EPSG:31467")
    (zone,) = local_zones(AirspaceSettings(zones=(given,)), scene()).zones
    np.testing.assert_allclose(zone.polygon, SQUARE, atol=0.01)


def test_many_polygons_become_many_zones(tmp_path):
    two = [polygon()["coordinates"], polygon(((20, 0), (30, 0), (30, 9)))["coordinates"]]
    path = written(tmp_path, {"type": "MultiPolygon", "coordinates": two}, name="both")
    zones = read_geojson(path)
    assert [len(zone.polygon) for zone in zones] == [4, 3]
    assert {zone.name for zone in zones} == {"both"}


def faults():
    ring = polygon()["coordinates"][0]
    yield {"type": "Point", "coordinates": [9, 53]}, {}, "holds a Point"
    yield {"type": "Polygon", "coordinates": [ring, ring]}, {}, "hole"
    yield {"type": "Polygon", "coordinates": [[[1, 2], ["x", 3]]]}, {}, "malformed"
    yield {"type": "Polygon", "coordinates": [ring[:2]]}, {}, "polygon"
    yield polygon(), {"kind": "forbidden"}, "kind"
    yield polygon(), {"bottom": 9, "top": 3}, "not below"
    yield {"type": "Polygon"}, {}, "not GeoJSON"
    yield {"type": "GeometryCollection", "geometries": []}, {}, "no polygon"


@pytest.mark.parametrize(("geometry", "properties", "message"), list(faults()))
def test_what_is_no_zone_is_refused_in_one_line(tmp_path, geometry, properties, message):
    path = written(tmp_path, geometry, **properties)
    with pytest.raises(PlannerError, match=message) as refusal:
        read_geojson(path)
    assert "\n" not in str(refusal.value)
    assert str(path) in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "message"), [("{", "JSON"), ("[" * 99_999, "JSON"), ("7", "None")]
)
def test_what_is_no_geojson_is_refused(tmp_path, text, message):
    path = tmp_path / "zones.geojson"
    path.write_text(text)
    with pytest.raises(PlannerError, match=message):
        read_geojson(path)
    with pytest.raises(PlannerError, match="check the path"):
        read_geojson(tmp_path / "none.geojson")


def test_a_scene_of_unknown_place_takes_local_zones_only(tmp_path):
    path = written(tmp_path, polygon())
    with pytest.raises(PlannerError, match=r"scene\.crs"):
        local_zones(AirspaceSettings(zone_files=(str(path),)), scene(None))
    with pytest.raises(PlannerError, match="mend"):
        local_zones(AirspaceSettings(zones=(ZoneSettings(polygon=SQUARE, crs="EPSG:0"),)), scene())


def test_nothing_between_heights_above_steep_ground_is_refused():
    corners = ((1.0, 1.0), (19.0, 1.0), (19.0, 19.0))
    zone = ZoneSettings(kind="keep_in", polygon=corners, bottom=0, top=2, heights="ground")
    with pytest.raises(PlannerError, match=r"rises by 3\.0 m"):
        local_zones(AirspaceSettings(zones=(zone,)), scene())


@pytest.mark.parametrize("name", ["urn:ogc:def:crs:OGC:1.3:CRS84", "OGC:CRS84"])
def test_a_crs_that_says_what_geojson_always_is_changes_nothing(tmp_path, name):
    plain = {"type": "Polygon", "coordinates": [in_the_world(SQUARE)]}
    path = tmp_path / "zones.geojson"
    path.write_text(json.dumps(plain))
    expected = read_geojson(path)
    path.write_text(json.dumps({**plain, "crs": {"type": "name", "properties": {"name": name}}}))
    assert read_geojson(path) == expected
    other = {"type": "name", "properties": {"name": "EPSG:25832"}}
    path.write_text(json.dumps({**plain, "crs": other}))
    with pytest.raises(PlannerError, match=r"zones\.geojson: names a crs other than CRS84"):
        read_geojson(path)
