"""The settings that a plan writes make the same plan again, byte for byte."""

import json
from dataclasses import replace

import numpy as np
import pytest

from planner import load_config, plan, synthetic_scene
from planner.geometry.frames import Frame
from planner.missions.records import read_json

ORIGIN = np.array([691_000.0, 5_334_000.0, 510.0])


def geojson(folder, corners, **properties):
    """A polygon given in local metres, written as longitude and latitude."""
    from pyproj import Transformer

    to_world = Transformer.from_crs("EPSG:25832", "EPSG:4326", always_xy=True)
    ring = [list(to_world.transform(x + ORIGIN[0], y + ORIGIN[1])) for x, y in corners]
    feature = {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": [[*ring, ring[0]]]},
    }
    path = folder / "zones.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    return path


@pytest.mark.slow
def test_zones_of_a_file_are_replayed_from_the_written_settings_alone(tmp_path):
    block = synthetic_scene(3, size=(42.0, 40.0), buildings=2, spacing=1.0)
    scene = replace(block, frame=Frame(ORIGIN, "EPSG:25832"))
    zones = geojson(tmp_path, [(-4, -30), (3, -30), (3, 31), (-4, 31)], name="railway", top=13.7)
    settings = [
        "scale.radius_share=0.08",
        "viewpoints.objective=hits",
        f"airspace.zone_files=['{zones}']",
        "airspace.unknown=closed",
        "airspace.ceiling=50.0",
        "sorties.stations=[[-24.0,-9.0]]",
        "sorties.method=split",
    ]
    first = plan(scene, load_config(None, settings))
    first.save(tmp_path / "first")
    zones.unlink()
    again = plan(scene, load_config(tmp_path / "first" / "config.toml"))
    again.save(tmp_path / "again")
    (zone,) = again.config.airspace.zones
    assert (zone.name, zone.crs) == ("railway", "local")
    assert again.config == first.config
    np.testing.assert_allclose(zone.polygon[1], (3.0, -30.0), atol=1e-3)
    names = {entry.name for entry in (tmp_path / "first").iterdir()}
    assert {"path.csv", "sorties.csv", "config.toml"} <= names
    for name in sorted(names - {"report.json"}):
        there, here = ((tmp_path / folder / name).read_bytes() for folder in ("first", "again"))
        assert there == here, name
    reports = [read_json(tmp_path / folder / "report.json") for folder in ("first", "again")]
    for report in reports:
        report.pop("timing")
    assert reports[0] == reports[1]
