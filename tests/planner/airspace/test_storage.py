"""Through a file and back; and everything that a damaged or hostile file may hold."""

import io
import json

import numpy as np
import pytest

from planner.airspace.airspace import Airspace, build_airspace
from planner.airspace.field import DistanceField
from planner.airspace.storage import read_arrays
from planner.config import AirspaceSettings, ZoneSettings
from planner.errors import PlannerError


@pytest.fixture(scope="module")
def airspace(make):
    roof = make.sheet((-8, -8), (0, 8), 9.0)
    limits = AirspaceSettings(
        ceiling=25.0,
        zone_margin=1.5,
        zones=(
            ZoneSettings(polygon=((5, 5), (9, 5), (9, 9)), top=7.0, name="Kläranlage"),
            ZoneSettings(kind="keep_in", polygon=((-30, -30), (30, -30), (30, 30), (-30, 30))),
        ),
    )
    scene = make.scene([[5, -5, 8.0]], heights=np.random.default_rng(0).uniform(0, 2, (20, 20)))
    return build_airspace(scene, roof, d_min=2.0, d_max=15.0, settings=limits)


def test_a_stored_airspace_gives_the_same_answers(airspace):
    stream = io.BytesIO()
    np.savez_compressed(stream, **airspace.to_arrays())
    stream.seek(0)
    with np.load(stream, allow_pickle=False) as arrays:
        again = Airspace.from_arrays(arrays)
    first, second = airspace.to_arrays(), again.to_arrays()
    assert first.keys() == second.keys()
    for key, value in first.items():
        np.testing.assert_array_equal(second[key], value)
        assert not value.dtype.hasobject
    np.testing.assert_array_equal(again.occupancy.bits, airspace.occupancy.bits)
    points = np.random.default_rng(1).uniform((-35, -35, -3), (35, 35, 30), (1000, 3))
    for question in ("clearance", "zone_margin", "is_free"):
        np.testing.assert_array_equal(
            getattr(again, question)(points), getattr(airspace, question)(points)
        )
    for a, b in zip(points[::2][:100], points[1::2], strict=False):
        assert again.edge_is_free(a, b) == airspace.edge_is_free(a, b)
    assert again.zones.prisms[0].name == "Kläranlage"
    assert again.ceiling == 25.0
    assert again.zones.kept == 1.5


def test_no_ceiling_and_no_points_survive(make):
    bare = build_airspace(make.scene(), make.boxes([]), d_min=2.0, d_max=15.0)
    again = Airspace.from_arrays(bare.to_arrays())
    assert again.ceiling is None
    assert again.obstacles.shape == (0, 3)
    assert again.zone_margin(np.zeros((1, 3)))[0] == np.inf


def record(**changes):
    base = {"kind": "keep_out", "polygon": [[0, 0], [1, 0], [0, 1]], "bottom": None, "top": 9}
    return np.array(json.dumps([{"name": "", **base, **changes}]))


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        *[
            (key, None, f"{key} is missing")
            for key in ("vertices", "obstacles", "d_min", "zones", "zone_margin")
        ],
        *[("zone_margin", np.array(value), "zone_margin") for value in (-0.1, np.inf, np.nan)],
        ("vertices", np.zeros((4, 2)), "vertices has shape"),
        ("vertices", np.full((9, 3), np.nan), "vertices holds values"),
        ("vertices", np.full((9, 3), 1e9), "vertices holds values"),
        ("vertices", np.zeros((4, 3)), "triangles name vertices"),
        ("triangles", np.zeros((3, 3)), "triangles holds float64"),
        ("triangles", np.full((3, 3), -1), "triangles name vertices|parts"),
        ("triangles", np.zeros((0, 3), int), "parts"),
        ("parts", np.array([1, -1, 1]), "parts"),
        ("parts", np.array([1, 1, 1]), "parts"),
        ("obstacles", np.array([[0, 0, np.inf]]), "obstacles holds values"),
        ("obstacles", np.array([["a", "b", "c"]]), "obstacles holds <U1"),
        ("obstacles", np.array([[None, 1, 2]]), "obstacles holds object"),
        ("ground_heights", np.zeros((0, 4)), "the ground"),
        ("ground_heights", np.zeros(4), "ground_heights has shape"),
        ("ground_cell", np.array(0.0), "the ground"),
        ("ground_cell", np.array(np.nan), "ground_cell holds"),
        ("d_min", np.array(-1.0), "d_min -1.0"),
        ("d_min", np.array(99.0), "d_min 99.0"),
        ("d_max", np.array(np.inf), "d_max holds"),
        ("low", np.full(3, 99.0), "bounds of the flight space"),
        ("ceiling", np.array(0.0), "ceiling 0.0"),
        ("ceiling", np.array(np.nan), "ceiling holds"),
        ("grid", np.array([2, 10_000]), "limits"),
        ("grid", np.array([1, 10**15]), "limits"),
        ("zones", np.array("[{"), "zones cannot be read"),
        ("zones", np.array("{}"), "zones"),
        ("zones", np.array("7"), "zones cannot be read"),
        ("zones", np.array(7.0), "zones cannot be read"),
        ("zones", np.array(["[]", "[]"]), "zones cannot be read"),
        ("zones", record(kind="keep"), "zones cannot be read"),
        ("zones", record(polygon=[[0, 0]]), "zones cannot be read"),
        ("zones", record(polygon=[[0, 0], [1, 0], [0, float("nan")]]), "zones cannot be read"),
        ("zones", record(polygon="abc"), "zones cannot be read"),
        ("zones", record(bottom=9.0), "zones cannot be read"),
        ("zones", record(top="high"), "zones cannot be read"),
    ],
)
@pytest.mark.parametrize("reader", [Airspace.from_arrays, DistanceField.from_arrays, read_arrays])
def test_a_spoilt_file_is_named_in_one_line(airspace, reader, key, value, complaint):
    arrays = airspace.to_arrays()
    if value is None:
        del arrays[key]
    else:
        arrays[key] = value
    with pytest.raises(PlannerError, match=complaint) as caught:
        reader(arrays, name="x/airspace.npz")
    message = str(caught.value)
    assert message.startswith("x/airspace.npz: ")
    assert message.endswith("; make the plan again")
    assert "\n" not in message


def test_objects_in_a_file_are_not_unpickled(airspace, tmp_path):
    arrays = airspace.to_arrays() | {"obstacles": np.array([[1, 2, None]])}
    np.savez(tmp_path / "airspace.npz", **arrays)
    with (
        np.load(tmp_path / "airspace.npz", allow_pickle=False) as stored,
        pytest.raises(PlannerError, match="obstacles cannot be read"),
    ):
        Airspace.from_arrays(stored)
