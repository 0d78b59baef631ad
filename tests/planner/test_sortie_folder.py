"""Sorties of a whole plan: written, proven, and every way of spoiling them is noticed."""

import json
import shutil

import numpy as np
import pytest

from planner import Plan, PlannerError, check_folder, load_config, plan, synthetic_scene
from planner.missions.records import read_json
from planner.report.numbers import in_sorties

SETTINGS = [
    "scale.radius_share=0.045",
    "seed=4",
    "sorties.stations=[[-30.0,-25.0]]",
    "sorties.endurance_seconds=250.0",
    "sorties.method=split",
]


@pytest.fixture(scope="module")
def scene():
    return synthetic_scene(3, size=(45.0, 40.0), buildings=3, spacing=0.8)


@pytest.fixture(scope="module")
def planned(scene):
    return plan(scene, load_config(None, SETTINGS))


@pytest.fixture(scope="module")
def written(planned, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plans") / "plan"
    planned.save(folder)
    return folder


@pytest.fixture
def folder(written, tmp_path):
    return shutil.copytree(written, tmp_path / "plan")


def spoil(folder, change):
    tree = read_json(folder / "sorties.json")
    change(tree)
    (folder / "sorties.json").write_text(json.dumps(tree))
    return check_folder(folder).problems


def test_sorties_are_written_proven_and_reported(planned, written):
    found = check_folder(written)
    assert found.ok
    assert found.sorties == len(planned.sorties.flown) >= 2
    assert "sorties keep that" in found.summary
    report = read_json(written / "report.json")["sorties"]
    assert report["count"] == found.sorties
    assert sum(entry["photos"] - entry["shared"] for entry in report["flown"]) == len(
        planned.viewpoints
    )
    assert all(entry["duration"] <= 250.0 * 0.75 + 1e-6 for entry in report["flown"])
    assert all(entry["certified_clearance"] >= planned.scale.d_min for entry in report["flown"])
    assert Plan.load(written).config.sorties == planned.config.sorties
    longest = max(entry["duration"] for entry in report["flown"])
    clause = in_sorties(report)
    assert clause.startswith(f", {found.sorties} sorties (longest {longest / 60.0:.1f} min")
    assert f"{100.0 * (1.0 - longest / 250.0):.0f} % of the battery left" in clause
    assert in_sorties(None) == ""


def test_each_written_row_keeps_its_distance_but_for_take_off_and_landing(planned, written):
    lines = (written / "sorties.csv").read_text().splitlines()
    assert lines[0] == "sortie,t,x,y,z,yaw_deg,pitch_deg,segment"
    rows = np.array([[float(value) for value in line.split(",")] for line in lines[1:]])
    flown = rows[rows[:, 7] >= 0]
    assert planned.airspace.clearance(flown[:, 2:5]).min() >= planned.scale.d_min
    assert len(rows) - len(flown) == 2 * len(planned.sorties.flown)
    for number, sortie in enumerate(planned.sorties.flown, start=1):
        own = rows[rows[:, 0] == number]
        assert own[0, 1] == 0.0
        assert own[-1, 1] == pytest.approx(sortie.duration, abs=1e-5)


def test_a_forgotten_photo_is_noticed(folder):
    def forget(tree):
        sortie = tree["sorties"][0]
        sortie["shared"].append(sortie["photos"][0])

    assert any("is taken by 0 sorties" in problem for problem in spoil(folder, forget))


def test_limits_that_are_not_kept_or_not_those_asked_for_are_noticed(folder):
    def tighten(tree):
        tree["most_seconds"] = 20.0

    assert any("where 20.0 s are allowed" in problem for problem in spoil(folder, tighten))

    def loosen(tree):
        tree["most_seconds"] = 1e6

    assert any("limits are not those of config" in problem for problem in spoil(folder, loosen))


def test_a_station_moved_into_a_building_is_noticed(folder, planned):
    roof = planned.scene.cloud.xyz[np.argmax(planned.scene.cloud.xyz[:, 2])]

    def move(tree):
        tree["stations"][0]["pad"] = [*roof[:2], 0.0]
        tree["stations"][0]["entry"] = [*roof[:2], 60.0]

    problems = spoil(folder, move)
    assert any("above station 0 the clearance is" in problem for problem in problems)
    assert any("stations are not those of config" in problem for problem in problems)


def test_a_curve_bent_into_a_building_is_named_with_its_sortie(folder, planned):
    roof = planned.scene.cloud.xyz[np.argmax(planned.scene.cloud.xyz[:, 2])]
    starts = planned.sorties.flown[1].path.controls[:, 0]
    bent = int(np.linalg.norm(starts - roof, axis=1).argmin())

    def bend(tree):
        piece = tree["sorties"][1]["pieces"][bent]["controls"]
        middle = roof - [0.0, 0.0, 2.0]
        piece[1] = piece[2] = ((middle - np.add(piece[0], piece[3]) / 8) / 0.75).tolist()

    problems = spoil(folder, bend)
    assert any(problem.startswith(f"sortie 2: segment {bent}") for problem in problems)
    assert any("sortie 2 takes" in problem for problem in problems)


def test_a_changed_row_is_named(folder):
    table = folder / "sorties.csv"
    lines = table.read_text().splitlines()
    row = int(0.6 * len(lines))
    fields = lines[row].split(",")
    fields[4] = f"{float(fields[4]) - 15.0:.4f}"
    table.write_text("\n".join([*lines[:row], ",".join(fields), *lines[row + 1 :]]) + "\n")
    problems = check_folder(folder).problems
    assert any(f"sorties.csv: line {row + 1}: is not what" in problem for problem in problems)
    table.write_text("\n".join(lines[:row] + lines[row + 1 :]) + "\n")
    assert not check_folder(folder).ok


@pytest.mark.parametrize("name", ["sorties.csv", "sorties.json"])
@pytest.mark.parametrize("content", [None, b"", b"\x00\xff garbage", b"{}", b"[1]"])
def test_a_missing_or_damaged_file_is_named(folder, name, content):
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)
    with pytest.raises(PlannerError, match=name) as caught:
        check_folder(folder)
    assert "\n" not in str(caught.value)


def test_a_station_where_nothing_was_scanned_is_told_with_its_distance(planned, written):
    (station,) = {id(sortie.station): sortie.station for sortie in planned.sorties.flown}.values()
    away = np.linalg.norm(planned.scene.cloud.xyz - station.pad, axis=1).min()
    found = [f for f in planned.findings if f.code == "station-outside-scan"]
    assert [f.number for f in found] == [pytest.approx(away)]
    assert away > planned.scale.d_min
    assert f"sorties.stations[0] = (-30, -25) is {away:.1f} m from" in found[0].message
    assert not found[0].partial
    told = read_json(written / "report.json")["findings"]
    assert "station-outside-scan" in {finding["code"] for finding in told}


def test_a_climb_that_comes_too_near_to_a_zone_is_noticed(folder, planned):
    x, y, z = planned.sorties.flown[0].station.pad
    post = [[x + 1.0, y - 1.0], [x + 2.0, y - 1.0], [x + 2.0, y + 1.0], [x + 1.0, y + 1.0]]
    zone = {"kind": "keep_out", "polygon": post, "bottom": None, "top": z + 0.2, "name": "post"}
    with np.load(folder / "airspace.npz") as stored:
        arrays = {**stored, "zones": np.array(json.dumps([zone]))}

    def climbs(kept):
        np.savez(folder / "airspace.npz", **{**arrays, "zone_margin": np.array(kept)})
        return [p for p in check_folder(folder).problems if "the climb at station 0" in p]

    assert not climbs(0.9)
    assert climbs(1.1)[0].endswith("too far into a zone or what is kept from it")


def test_sorties_that_nobody_asked_for_are_noticed(folder):
    text = (folder / "config.toml").read_text()
    (folder / "config.toml").write_text(
        "\n".join(line for line in text.splitlines() if not line.startswith("stations ="))
    )
    assert any("names no station" in problem for problem in check_folder(folder).problems)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        ("sorties.endurance_seconds=20.0", "s are needed"),
        ("sorties.stations=[[900.0,0.0]]", "outside of the space in which"),
        ("sorties.stations=[[0.0,0.0]]", None),
    ],
)
def test_what_cannot_be_flown_is_refused_in_one_line(scene, planned, setting, complaint):
    if complaint is None:  # inside of a building
        roof = planned.scene.cloud.xyz[np.argmax(planned.scene.cloud.xyz[:, 2])]
        setting, complaint = f"sorties.stations=[[{roof[0]},{roof[1]}]]", "something solid"
    with pytest.raises(PlannerError, match=complaint) as caught:
        plan(scene, load_config(None, [*SETTINGS, setting]))
    assert str(caught.value).startswith("sorties.")
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_the_written_settings_give_the_same_bytes(scene, written, tmp_path):
    plan(scene, load_config(written / "config.toml")).save(tmp_path / "again")
    for name in ("sorties.csv", "sorties.json", "path.csv", "viewpoints.csv"):
        assert (tmp_path / "again" / name).read_bytes() == (written / name).read_bytes()
