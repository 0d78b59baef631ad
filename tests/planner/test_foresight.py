"""What cannot be is refused before the work that it would waste."""

import json
import sys
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from planner import attempts, cli, load_config, load_scene, plan
from planner.airspace.airspace import build_airspace
from planner.airspace.candidates import candidate_positions
from planner.airspace.zone_files import read_geojson
from planner.errors import PlannerError, Unattainable
from planner.foresight import refuse_place, refuse_settings
from planner.scale import derive_scale
from planner.scene.cloud import Mesh
from planner.sorties.station import find_stations
from planner.viewpoints.camera import camera_of

TRIANGLE = "polygon = [[0, 0], [9, 0], [0, 9]]"


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """A box of 20 x 14 x 8 m on level ground."""
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(-25, 25, (4000, 2)), rng.normal(0, 0.02, 4000)])
    roof = np.column_stack([rng.uniform(-10, 10, 4000), rng.uniform(-7, 7, 4000), np.full(4000, 8)])
    path = tmp_path_factory.mktemp("scan") / "a.xyz"
    np.savetxt(path, np.vstack([ground, roof]), fmt="%.6f")
    return path


def test_files_of_zones_are_read_once(scan, tmp_path, monkeypatch):
    read, corners = [], [[0.0, 0.0], [1e-4, 0.0], [0.0, 1e-4], [0.0, 0.0]]
    path = tmp_path / "zones.geojson"
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [corners]}))
    monkeypatch.setattr(
        "planner.airspace.zone_files.read_geojson",
        lambda name: read.append(name) or read_geojson(name),
    )
    with pytest.raises(PlannerError, match="set scene"):
        plan(scan, load_config(None, [f"airspace.zone_files=['{path}']"]))
    assert read == [str(path)]


@dataclass(frozen=True)
class Deaf:
    """A solver that no number of iterations ends."""

    name: ClassVar[str] = "deaf"
    ignores: ClassVar[frozenset[str]] = frozenset({"iterations"})

    def run(self, problem, run):
        raise AssertionError


SETTINGS = [
    (["route.solver=two-optt"], "route.solver = 'two-optt': .* Did you mean 'two-opt'"),
    (
        [f"route.solver={__name__}:Deaf", "route.iterations=9"],
        "Deaf': heeds no limit on route.iterations; .* or leave route.iterations out",
    ),
    (["viewpoints.pair_solver=nope:Nope"], "viewpoints.pair_solver = 'nope:Nope': .*cannot be"),
    (["scene.images=none.csv"], "none.csv: it cannot be read .No such file"),
    (["scene.images=none.png"], "none.png: the extension '.png' is unknown for poses"),
    (["airspace.zone_files=['none.geojson']"], "none.geojson: cannot be read .No such file"),
    (["scene.crs=EPSG:9999999"], "scene.crs = 'EPSG:9999999': is not known; give an EPSG code"),
    (["scene.crs=EPSG:4326"], "scene.crs = 'EPSG:4326': is no map projection; project"),
    (
        [f"airspace.zones=[{{{TRIANGLE}}}, {{{TRIANGLE}, crs='here'}}]"],
        r"airspace.zones\[1\].crs = 'here': is not known",
    ),
    (
        ["camera.pitch_min_deg=50", "camera.pitch_max_deg=60"],
        "camera.pitch_min_deg = 50: nothing below the horizon",
    ),
    (
        ["scale.d_min=9", "scale.d_max=11"],
        "scale.d_min = 9: leaves no room below d_max 11 m; lower it under 8.8 m or raise scale.d_m",
    ),
    (["scale.d_min=9", "scale.gsd=0.001"], "leaves no room below d_max .* or raise scale.gsd"),
    (["scale.d_min=9", "airspace.ceiling=8.5"], "airspace.ceiling = 8.5: .* by over 0.50 m"),
    (
        ["scale.d_min=9", "airspace.ceiling=11", "airspace.zone_margin=4"],
        "ceiling = 11: is under 4 m of zone_margin over d_min 9 m, .* by over 2.00 m or lower "
        "scale.d_min or airspace.zone_margin",
    ),
    (["sorties.stations=[[0,0]]", "sorties.most_waypoints=2"], "most_waypoints = 2: .* raise it"),
]
"""Settings that no place suits."""


@pytest.mark.parametrize(("settings", "complaint"), SETTINGS)
def test_impossible_settings_are_refused_before_anything_is_read(settings, complaint, monkeypatch):
    monkeypatch.chdir("/")
    with pytest.raises(PlannerError, match=complaint) as caught:
        plan("missing.xyz", load_config(None, settings), listener=lambda *_: pytest.fail("began"))
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_a_solver_that_heeds_no_limit_is_refused_where_one_is_always_set():
    for table in ("flight.solver", "viewpoints.pair_solver"):
        with pytest.raises(
            PlannerError, match=r"'.*:Deaf': heeds no limit.*; choose another solver$"
        ):
            refuse_settings(load_config(None, [f"{table}={__name__}:Deaf"]))


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        (
            ["camera.pitch_min_deg=10", "camera.pitch_max_deg=-10"],
            "camera: pitch_min_deg = 10 is above pitch_max_deg = -10; swap them",
        ),
        (
            ["viewpoints.objective=hits", "viewpoints.sectors=8", "viewpoints.sector_count=4"],
            "viewpoints: sectors = 8 are more than sector_count = 4; lower",
        ),
    ],
)
def test_settings_that_contradict_each_other_are_refused_when_they_are_read(settings, complaint):
    with pytest.raises(PlannerError, match=complaint):
        load_config(None, settings)


@pytest.mark.parametrize("verb", ["plan", "demo"])
@pytest.mark.parametrize("settings", [settings for settings, _ in SETTINGS[::3]])
def test_the_command_begins_nothing_and_writes_nothing(  # noqa: PLR0917 - fixtures
    verb, settings, scan, tmp_path, monkeypatch, capfd
):
    given = [part for setting in settings for part in ("--set", setting)]
    source = [str(scan)] if verb == "plan" else []
    arguments = ["scanwright", verb, *source, "--out", str(tmp_path / "plan"), *given]
    monkeypatch.setattr(sys, "argv", arguments)
    monkeypatch.chdir("/")
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("scanwright: ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        (["scale.radius=500"], r"a.xyz: scale.radius 500 m is more than the whole scene, [\d.]+ m"),
        (["scale.radius=0.001"], r"a.xyz: scale.radius 0.001 m makes more samples than fit"),
        (["scale.radius_share=1e-6"], "makes more samples than fit into memory; raise it to"),
        (["airspace.ceiling=1"], r"airspace.ceiling = 1: is under d_min [\d.]+ m"),
        (
            ["viewpoints.pair_range=0.01"],
            r"pair_range = 0.01: .*within d_min .*; raise it over 0\.0",
        ),
        (["sorties.stations=[[0,0],[900,0]]"], r"stations\[1\] = \(900, 0\): is [\d.]+ m outside"),
        (["sorties.stations=[[20,20,-9]]"], r"its height -9 m is 9\.\d m under the ground; leave"),
        (
            ["sorties.stations=[[20,20,900]]"],
            r"is at 900.0 m, where flight is considered up to .*; leave",
        ),
        (
            ["sorties.stations=[[20,20]]", "sorties.endurance_seconds=2"],
            "endurance_seconds = 2: to climb to d_min .* leaves 2 s; raise it",
        ),
    ],
)
def test_what_does_not_suit_the_place_is_refused_before_its_surface_is_made(
    settings, complaint, scan
):
    stages = []
    with pytest.raises(PlannerError, match=complaint) as caught:
        plan(scan, load_config(None, settings), listener=lambda stage, _: stages.append(stage))
    assert set(stages) == {"scene"}
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def place(scan):
    """The scan with its lengths, and its airspace without a surface."""
    config = load_config(None, ["scale.radius_share=0.06"])
    scene = load_scene(scan)
    scale = derive_scale(scene, camera_of(config.camera), config.scale)
    return config, scene, scale, airspace_of(scene, scale, config)


def airspace_of(scene, scale, config):
    flat = Mesh([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]], [[0, 1, 2]])
    return build_airspace(
        scene, flat, d_min=scale.d_min, d_max=scale.d_max, settings=config.airspace
    )


def complaint_of(act):
    try:
        act()
    except PlannerError as error:
        return str(error)
    return ""


def climbs_free(space, pad):
    """Whether some height ``d_min`` or more over a pad is free, and nothing solid under it."""
    heights = np.arange(0.1, space.bounds[1][2] - pad[2], 0.1)
    way = pad + heights[:, None] * np.array([0.0, 0.0, 1.0])
    if not len(way):
        return False
    free = np.flatnonzero(space.is_free(way) & (heights >= space.d_min))
    return bool(len(free)) and bool((space.clearance(way[: free[0]]) > -0.1).all())


def test_a_station_is_refused_early_only_where_no_flight_can_begin(place):
    config, scene, scale, space = place
    (low, high), rng = space.bounds, np.random.default_rng(1)
    points = [tuple(point) for point in rng.uniform(low[:2] - 30.0, high[:2] + 30.0, (40, 2))]
    points += [(20.0, 20.0, z) for z in np.linspace(-20.0, high[2] + 20.0, 40)]
    early, able = 0, 0
    for point in points:
        stations = config.sorties.model_copy(update={"stations": (point,)})
        asked = config.model_copy(update={"sorties": stations})
        soon = complaint_of(lambda asked=asked: refuse_place(asked, scene, scale))
        late = complaint_of(
            lambda point=point: find_stations([point], space, space.terrain.height, margin=0.002)
        )
        ground = float(space.terrain.height(np.array([point[:2]]))[0])
        pad = np.array([*point[:2], point[2] if len(point) > 2 else ground])
        beyond = bool((pad[:2] < low[:2]).any() or (pad[:2] > high[:2]).any())
        deep, high_up = ground - scale.d_min, high[2] - scale.d_min - 0.004
        assert bool(soon) == (beyond or not deep <= pad[2] < high_up)
        assert late == soon or not soon
        assert not (soon and climbs_free(space, pad))
        early, able = early + bool(soon), able + climbs_free(space, pad)
    assert 20 < early < 60
    assert able > 10


@pytest.mark.parametrize(
    ("over", "kept", "refused"),
    [(-0.01, 0.0, True), (7.0, 0.0, False), (4.99, 5.0, True), (12.0, 5.0, False)],
)
def test_a_ceiling_is_refused_early_only_if_nothing_is_free(place, over, kept, refused):
    config, scene, scale, _ = place
    low = config.airspace.model_copy(update={"ceiling": scale.d_min + over, "zone_margin": kept})
    config = config.model_copy(update={"airspace": low})
    assert bool(complaint_of(lambda: refuse_place(config, scene, scale))) == refused
    space = airspace_of(scene, scale, config)
    grid = candidate_positions(space, box=scene.box, voxel=scale.voxel, limit=10_000, margin=0.002)
    assert (len(grid.positions) == 0) == refused


def test_the_smallest_radius_that_is_told_is_taken(scan, place):
    scene = place[1]
    config = load_config(None, ["scale.radius=0.0001"])
    small = derive_scale(scene, camera_of(config.camera), config.scale)
    line = complaint_of(lambda: refuse_place(config, scene, small))
    radius = line.split("raise it to ")[1].split(" m ")[0]
    config = load_config(None, [f"scale.radius={radius}"])
    enough = derive_scale(scene, camera_of(config.camera), config.scale)
    refuse_place(config, scene, enough)


def hills(corners, spacing=4.0):
    """Points of soft hills within rectangles (x, y, x, y), turned by 45 degrees."""
    grids = [
        np.stack(np.meshgrid(np.arange(a, c, spacing), np.arange(b, d, spacing)), axis=-1)
        for a, b, c, d in corners
    ]
    xy = np.vstack([grid.reshape(-1, 2) for grid in grids]) @ np.array([[1, 1], [-1, 1]]) / 2**0.5
    return np.column_stack([xy, 9.0 * np.sin(0.02 * xy[:, 0])])


@pytest.mark.parametrize(
    ("corners", "area"),
    [
        ([(0, 0, 2000, 30)], 60_000.0),
        ([(0, 0, 2000, 40), (0, 0, 40, 2000)], 158_400.0),
    ],
    ids=["strip", "elbow"],
)
def test_a_place_counts_by_its_own_area_and_not_by_that_around_it(tmp_path, corners, area):
    np.savetxt(tmp_path / "a.xyz", hills(corners), fmt="%.4f")
    scene = load_scene(tmp_path / "a.xyz")
    for squares, refused in ((2.2e7, False), (1.2e8, True)):  # 5e7 are too many
        config = load_config(None, [f"scale.radius={(area / squares) ** 0.5}"])
        scale = derive_scale(scene, camera_of(config.camera), config.scale)
        line = complaint_of(lambda config=config, scale=scale: refuse_place(config, scene, scale))
        assert ("more samples than fit" in line) == refused
    told = float(line.split("raise it to ")[1].split(" m ")[0])
    assert 0.95 * (area / 5e7) ** 0.5 <= told <= 1.6 * (area / 5e7) ** 0.5


def test_a_target_that_no_photos_reach_is_to_be_lowered(scan):
    small = ["scale.radius_share=0.06", "viewpoints.target=1e6", "viewpoints.effort=quick"]
    with pytest.raises(
        Unattainable, match=r"reach viewpoints.target 1e\+06 .*; lower viewpoints.ta"
    ):
        plan(scan, load_config(None, small))


@pytest.mark.parametrize("preset", [["preset=paper"], ["objective=hits"]])
def test_the_target_is_not_blamed_where_nothing_reads_it(scan, preset, monkeypatch):
    def nothing(*given, **settings):
        found = genuine(*given, **settings)
        return replace(found, viewpoints=found.viewpoints.take(np.zeros(0, dtype=np.int64)))

    genuine = attempts.select_viewpoints
    monkeypatch.setattr(attempts, "select_viewpoints", nothing)
    settings = ["scale.radius_share=0.1", *(f"viewpoints.{word}" for word in preset)]
    with pytest.raises(Unattainable, match="finds no photo worth taking") as caught:
        plan(scan, load_config(None, settings))
    assert "target" not in str(caught.value)
