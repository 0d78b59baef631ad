"""A written plan proves itself, and every way of spoiling it is noticed and named."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from planner import Plan, PlannerError, PlanStatus, check_folder, load_config, plan, synthetic_scene
from planner.airspace.airspace import Airspace
from planner.geometry import bezier
from planner.missions.faults import row_faults
from planner.missions.records import read_json

SETTINGS = ["scale.radius_share=0.03", "seed=4", "viewpoints.sharp_share=1.0"]  # close to things
FILES = {
    "airspace.npz",
    "config.toml",
    "overview.png",
    "path.csv",
    "path.json",
    "report.json",
    "samples.ply",
    "scene.json",
    "viewpoints.csv",
}


@pytest.fixture(scope="module")
def scene():
    return synthetic_scene(3, size=(45.0, 40.0), buildings=5, spacing=0.5)


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


def test_the_plan_is_complete_and_every_file_is_there(planned, written):
    assert planned.status is PlanStatus.COMPLETE
    assert {entry.name for entry in written.iterdir()} == FILES
    assert check_folder(written).ok


def test_a_plan_that_fails_its_check_names_no_folder_that_is_gone(planned, tmp_path, monkeypatch):
    def doubtful(folder, **options):
        proof = check_folder(folder, **options)
        return replace(proof, problems=(f"{folder / 'path.csv'}: line 44: is too near",))

    monkeypatch.setattr("planner.report.folder.check_folder", doubtful)
    with pytest.raises(PlannerError, match=r"its check failed \(path\.csv: line 44: is too near\)"):
        planned.save(tmp_path / "plan")
    assert not list(tmp_path.iterdir())


def test_no_point_of_the_curve_is_nearer_than_asked_by_brute_force(planned):
    controls = planned.flight.path.controls
    steps = np.linspace(0.0, 1.0, 400)
    dense = bezier.evaluate(controls[:, None], np.broadcast_to(steps, (len(controls), 400)))
    nearest, _ = cKDTree(planned.scene.cloud.xyz).query(dense.reshape(-1, 3))
    assert nearest.min() >= planned.scale.d_min
    assert planned.airspace.clearance(dense[:, ::20].reshape(-1, 3)).min() >= planned.scale.d_min


def test_what_is_certified_is_a_bound_of_what_the_check_finds(planned, written):
    path = planned.flight.path
    with np.load(written / "airspace.npz", allow_pickle=False) as arrays:
        airspace = Airspace.from_arrays(dict(arrays))
    middle = bezier.evaluate(path.controls, np.full(len(path), 0.5))
    assert (airspace.clearance(middle) >= path.clearance - 1e-9).all()
    assert (path.clearance >= planned.scale.d_min).all()


def test_the_report_says_what_shares_have_target_floor_and_sharp_photos(planned, written):
    found = read_json(written / "report.json")["viewpoints"]
    h, wish = planned.selection.reconstructability, planned.selection.wish
    target, floor = found["reconstructable"], found["reconstructable"]["floor"]
    assert (target["target"], target["wanted"]) == (4.0, 0.98)
    assert target["samples"] == wish.pairs.reachable.sum()
    assert 0.98 <= target["share"] <= np.mean(h[wish.pairs.reachable] >= 4.0)
    assert (floor["h"], floor["wanted"]) == (3.6, 0.995)
    assert floor["share"] == np.mean(h[wish.pairs.floor.reachable] >= 3.6) >= 0.995
    can = wish.stages[3] > 0
    sharp = {"views": 1, "samples": can.sum(), "wanted": 1.0}
    assert found["sharp"] == {**sharp, "share": np.mean(planned.selection.hits[can] >= 1)}


def test_report_numbers_agree_with_the_files(planned, written):
    report = read_json(written / "report.json")
    lines = (written / "viewpoints.csv").read_text().splitlines()
    assert report["viewpoints"]["count"] == len(lines) - 1 == len(planned.viewpoints)
    assert report["path"]["length"] == pytest.approx(planned.flight.path.length)
    assert sum(report["viewpoints"]["reasons"].values()) == len(planned.samples)
    assert report["path"]["certified_clearance"] >= report["airspace"]["d_min"]
    assert report["path"]["duration"] == pytest.approx(planned.rows[-1, 0], abs=1e-6)
    proof, xyz = report["check"], planned.rows[:, 1:4]
    assert proof["line_clearance"] >= report["airspace"]["d_min"] - 2e-4
    least = planned.airspace.clearance(xyz).min()
    assert proof["line_clearance"] <= least
    assert proof["line_clearance"] >= least - 0.05 * report["airspace"]["d_min"]
    assert planned.airspace.clearance(np.array([proof["line_nearest"]]))[0] <= least + 1e-4


def test_a_written_plan_is_read_back(planned, written):
    back = Plan.load(written)
    assert back.config == planned.config
    assert back.limits == planned.timeline.limits
    np.testing.assert_array_equal(back.path.controls, planned.flight.path.controls)
    np.testing.assert_allclose(back.viewpoints.positions, planned.viewpoints.positions, atol=1e-9)
    np.testing.assert_array_equal(back.frame.origin, planned.scene.frame.origin)
    probes = planned.scene.cloud.xyz[::50] + [0.0, 0.0, 3.0]
    np.testing.assert_array_equal(
        back.airspace.clearance(probes), planned.airspace.clearance(probes)
    )


def test_heights_in_a_unit_of_their_own_are_read_back(planned, written, tmp_path):
    frame = replace(planned.scene.frame, unit_metres=1200 / 3937, height_unit_metres=0.3048)
    replace(planned, scene=replace(planned.scene, frame=frame)).save(tmp_path / "plan")
    back = Plan.load(tmp_path / "plan").frame
    assert (back.unit_metres, back.height_unit_metres) == (1200 / 3937, 0.3048)
    assert Plan.load(written).frame.height_unit_metres is None
    record = read_json(tmp_path / "plan" / "scene.json")
    del record["height_unit_metres"]
    (tmp_path / "plan" / "scene.json").write_text(json.dumps(record))
    assert Plan.load(tmp_path / "plan").frame.height_unit_metres is None


def lines_of(path):
    return path.read_text().splitlines()


def test_a_waypoint_moved_into_a_building_is_named_with_its_clearance(folder, planned):
    table = folder / "viewpoints.csv"
    lines = lines_of(table)
    roof = planned.scene.cloud.xyz[np.argmax(planned.scene.cloud.xyz[:, 2])] - [0.0, 0.0, 1.0]
    fields = lines[11].split(",")
    fields[1:4] = [f"{value:.4f}" for value in roof]
    table.write_text("\n".join([*lines[:11], ",".join(fields), *lines[12:]]) + "\n")
    result = check_folder(folder)
    assert not result.ok
    assert "viewpoints.csv: line 12" in result.problems[0]
    assert "segment" in result.problems[0]
    assert "clearance there is" in result.problems[0]


def test_a_curve_bent_into_a_building_is_named_with_segment_and_clearance(folder, planned):
    tree = read_json(folder / "path.json")
    roof = planned.scene.cloud.xyz[np.argmax(planned.scene.cloud.xyz[:, 2])]
    ends = np.linalg.norm(planned.flight.path.controls[:, [0, 3]] - roof, axis=2)
    piece = int(np.argmin(ends.max(axis=1)))
    tree["pieces"][piece]["controls"][1] = tree["pieces"][piece]["controls"][2] = roof.tolist()
    (folder / "path.json").write_text(json.dumps(tree))
    result = check_folder(folder)
    assert not result.ok
    assert any(problem.startswith(f"segment {piece}: comes within") for problem in result.problems)


@pytest.mark.parametrize("line", [1, 57, -1])
def test_a_line_deleted_from_the_path_table_is_named(folder, line):
    table = folder / "path.csv"
    lines = lines_of(table)
    gone = line % len(lines)
    table.write_text("\n".join(lines[:gone] + lines[gone + 1 :]) + "\n")
    result = check_folder(folder)
    assert not result.ok
    assert f"path.csv: line {gone + 1}" in result.problems[0]


def test_a_row_moved_so_that_a_straight_line_cuts_a_corner_is_found(folder, planned):
    table = folder / "path.csv"
    lines = lines_of(table)
    rows = np.array([[float(value) for value in line.split(",")] for line in lines[1:]])
    clearance = planned.airspace.clearance(rows[:, 1:4])
    row = 50 + int(clearance[50:-50].argmin())  # nearest to something solid
    towards = planned.scene.cloud.xyz - rows[row, 1:4]
    away = np.linalg.norm(towards, axis=1)
    share = (clearance[row] - planned.scale.d_min + 0.1) / away.min()
    fields = lines[row + 1].split(",")
    moved = rows[row, 1:4] + share * towards[away.argmin()]
    fields[1:4] = [f"{value:.4f}" for value in moved]
    table.write_text("\n".join([*lines[: row + 1], ",".join(fields), *lines[row + 2 :]]) + "\n")
    problems = check_folder(folder).problems
    assert any("is not what path.json gives" in problem for problem in problems)
    close = [problem for problem in problems if "straight line to it comes within" in problem]
    assert any(f"path.csv: line {line}:" in close[0] for line in (row + 2, row + 3))


def test_deleted_rows_between_which_a_straight_line_cuts_a_corner_are_found(folder, planned):
    table = folder / "path.csv"
    lines = lines_of(table)
    rows = np.array([[float(value) for value in line.split(",")] for line in lines[1:]])
    share = np.linspace(0.0, 1.0, 60)[:, None]
    for row in range(0, len(rows) - 150, 10):  # a line that cuts through something
        line = (1 - share) * rows[row, 1:4] + share * rows[row + 150, 1:4]
        if planned.airspace.clearance(line).min() < 0.8 * planned.scale.d_min:
            break
    table.write_text("\n".join([*lines[: row + 2], *lines[row + 151 :]]) + "\n")
    problems = check_folder(folder).problems
    assert any(f"path.csv: line {row + 3}: the straight line to it" in item for item in problems)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_truncated_path_is_named_with_its_line(folder, share):
    text = (folder / "path.json").read_text()
    (folder / "path.json").write_text(text[: int(share * len(text))])
    with pytest.raises(PlannerError, match=r"path\.json: line \d+"):
        check_folder(folder)


def test_a_torn_curve_is_refused(folder):
    tree = read_json(folder / "path.json")
    tree["pieces"][5]["controls"][0][2] += 3.0
    (folder / "path.json").write_text(json.dumps(tree))
    with pytest.raises(PlannerError, match=r"path\.json: piece 5"):
        check_folder(folder)


@pytest.mark.parametrize(
    "name", sorted(FILES - {"overview.png", "samples.ply", "config.toml", "report.json"})
)
@pytest.mark.parametrize("content", [None, b"", b"\x00\xff garbage"])
def test_a_missing_or_damaged_file_is_named(folder, name, content):
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)
    with pytest.raises(PlannerError, match=name) as caught:
        check_folder(folder)
    assert "\n" not in str(caught.value)


def test_missing_settings_are_named_with_the_cure_of_a_plan(folder):
    (folder / "config.toml").unlink()
    for read in (check_folder, Plan.load):
        with pytest.raises(PlannerError, match=r"config\.toml: is missing; plan again"):
            read(folder)


def test_settings_that_are_none_are_refused(scene):
    with pytest.raises(TypeError, match="config must be a Config"):
        plan(scene, "x")


@pytest.mark.parametrize(
    ("column", "by", "told"),
    [
        (0, 0.002, "t 5.002 where 5 was"),
        (2, -0.0011, "y 6.9989 where 7 was"),
        (4, -0.5, "yaw_deg 0.5 where 1 was"),
        (6, 1.0, "segment 4 where 3 was"),
    ],
)
def test_the_column_that_is_wrong_is_told(tmp_path, column, by, told):
    wanted = np.array([[4.8, 6.0, 7.0, 8.0, 1.0, -20.0, 3.0], [5.0, 6.0, 7.0, 8.0, 1.0, -20.0, 3]])
    rows = wanted.copy()
    assert not row_faults(tmp_path, rows, wanted, first_line=2, source="path.json")
    rows[1, column] += by
    (fault,) = row_faults(tmp_path, rows, wanted, first_line=2, source="path.json")
    assert f"line 3: is not what path.json gives ({told} expected, segment 3)" in fault


def test_an_airspace_with_pickled_objects_is_refused(folder):
    np.savez(folder / "airspace.npz", vertices=np.array([{"a": 1}], dtype=object))
    with pytest.raises(PlannerError, match=r"airspace\.npz"):
        check_folder(folder)


def test_another_scene_file_is_noticed(folder, tmp_path):
    (tmp_path / "other.ply").write_bytes(b"ply")
    assert "is not the file" in check_folder(folder, scene=tmp_path / "other.ply").problems[0]


def files_of(folder):
    contents = {entry.name: entry.read_bytes() for entry in folder.iterdir()}
    report = json.loads(contents["report.json"])
    del report["timing"]
    contents["report.json"] = json.dumps(report).encode()
    return contents


@pytest.mark.slow
def test_the_same_seed_and_the_written_settings_give_the_same_bytes(scene, written, tmp_path):
    plan(scene, load_config(written / "config.toml")).save(tmp_path / "again")
    assert files_of(tmp_path / "again") == files_of(written)


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["cover", "paper"])
def test_workers_do_not_change_a_byte(scene, tmp_path, preset):
    import multiprocessing

    config = load_config(None, [*SETTINGS, f"viewpoints.preset={preset}"])
    plan(scene, config).save(tmp_path / "one")
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        plan(scene, config, map=pool.map).save(tmp_path / "two")
    assert files_of(tmp_path / "one") == files_of(tmp_path / "two")


def test_a_wall_of_no_fly_zone_and_a_ceiling_are_kept(scene, tmp_path):
    zone = "{polygon=[[-3.0,-60.0],[3.0,-60.0],[3.0,60.0],[-3.0,60.0]],top=28.0}"
    settings = [*SETTINGS, f"airspace.zones=[{zone}]", "airspace.ceiling=40.0"]
    result = plan(scene, load_config(None, settings))
    result.save(tmp_path / "plan")
    rows = Plan.load(tmp_path / "plan").rows
    inside = (np.abs(rows[:, 1]) < 3.0) & (np.abs(rows[:, 2]) < 60.0) & (rows[:, 3] < 28.0)
    assert not inside.any()
    assert (np.sign(rows[:, 1]) > 0).any()
    assert (np.sign(rows[:, 1]) < 0).any()  # both sides are photographed, over the zone
    height = rows[:, 3] - scene.ground.height(rows[:, 1:3])
    assert height.max() <= 40.0 + 1e-6
    assert check_folder(tmp_path / "plan").zone_distance >= -2e-4


WALL = "airspace.zones=[{polygon=[[-3.0,-60.0],[3.0,-60.0],[3.0,60.0],[-3.0,60.0]],top=20.0}]"


@pytest.fixture(scope="module")
def apart(scene, tmp_path_factory):
    """A plan that keeps three metres from a zone and from the ceiling, and its folder."""
    found = plan(
        scene,
        load_config(None, [*SETTINGS, WALL, "airspace.ceiling=40.0", "airspace.zone_margin=3.0"]),
    )
    folder = tmp_path_factory.mktemp("plans") / "apart"
    found.save(folder)
    return found, folder


def test_a_margin_is_kept_from_zones_and_from_the_ceiling(scene, apart):
    found, folder = apart
    controls = found.flight.path.controls
    steps = np.broadcast_to(np.linspace(0.0, 1.0, 100), (len(controls), 100))
    flown = bezier.evaluate(controls[:, None], steps).reshape(-1, 3)
    flown = np.concatenate([flown, Plan.load(folder).rows[:, 1:4]])
    wall = np.array([[-3.0, -60.0, -99.0], [3.0, 60.0, 20.0]])
    away = np.linalg.norm(np.maximum(wall[0] - flown, flown - wall[1]).clip(0.0), axis=1)
    assert 3.0 <= away.min() + 1e-4 < 5.0  # the wall is in the way
    assert (flown[:, 2] - scene.ground.height(flown)).max() <= 37.0 + 1e-4
    proven = check_folder(folder)
    assert proven.ok
    assert 3.0 - 2e-4 <= proven.zone_distance <= away.min() + 1e-4
    report = read_json(folder / "report.json")
    assert report["airspace"]["zone_margin"] == 3.0
    assert 3.0 <= report["path"]["certified_zone_margin"] <= away.min() + 1e-4


@pytest.mark.parametrize("config_too", [False, True])
@pytest.mark.parametrize("kept", [0.0, 3.6])
def test_another_margin_of_zones_is_noticed_from_the_files_alone(apart, tmp_path, kept, config_too):
    folder = shutil.copytree(apart[1], tmp_path / "plan")
    with np.load(folder / "airspace.npz") as stored:
        arrays = dict(stored)
    np.savez(folder / "airspace.npz", **{**arrays, "zone_margin": np.array(kept)})
    if config_too:
        text = (folder / "config.toml").read_text()
        assert "zone_margin = 3.0" in text
        (folder / "config.toml").write_text(
            text.replace("zone_margin = 3.0", f"zone_margin = {kept}")
        )
    problems = check_folder(folder, sealed=False).problems
    lines = [p for p in problems if "path.csv" in p and p.endswith("3.600 m is asked for")]
    pieces = [
        p for p in problems if p.startswith("segment ") and p.endswith("3.600 m is asked for")
    ]
    assert bool(lines) == bool(pieces) == (kept > 3.0)
    told = [p for p in problems if f"zone_margin is {kept:g}, but 3 in config.toml" in p]
    assert bool(told) != config_too
    assert not check_folder(folder).ok


@pytest.mark.parametrize(
    ("setting", "complaint"),
    [
        ("airspace.ceiling=3.0", "no position is free"),
        ("airspace.zones=[{kind='keep_in',polygon=[[0,0],[0.1,0],[0,0.1]],top=0.5}]", "zones"),
    ],
)
def test_what_leaves_no_room_is_refused_with_its_numbers(scene, setting, complaint):
    with pytest.raises(PlannerError, match=complaint) as caught:
        plan(scene, load_config(None, [*SETTINGS, setting]))
    assert "d_min" in str(caught.value)


def test_a_changed_file_is_noticed_even_where_it_proves_nothing(folder):
    with (folder / "samples.ply").open("ab") as stream:
        stream.write(b"\0")
    result = check_folder(folder)
    assert not result.ok
    assert "samples.ply: was changed" in result.problems[-1]


def test_a_distance_that_was_lowered_is_noticed(folder):
    with np.load(folder / "airspace.npz") as stored:
        arrays = dict(stored)
    np.savez(folder / "airspace.npz", **{**arrays, "d_min": np.array(0.01)})
    problems = check_folder(folder).problems
    assert any("d_min is 0.01" in problem for problem in problems)


def test_one_photo_inside_a_building_is_unsafe(folder, planned):
    tree = read_json(folder / "path.json")
    tree["pieces"], tree["start"] = [], 0
    (folder / "path.json").write_text(json.dumps(tree))
    lines = lines_of(folder / "viewpoints.csv")
    fields = lines[1].split(",")
    roof = planned.scene.cloud.xyz[np.argmax(planned.scene.cloud.xyz[:, 2])] - [0.0, 0.0, 1.0]
    fields[1:4] = [f"{value:.4f}" for value in roof]
    (folder / "viewpoints.csv").write_text("\n".join([lines[0], ",".join(fields)]) + "\n")
    assert any("comes within" in problem for problem in check_folder(folder).problems)


@pytest.mark.parametrize("name", ["airspace.npz", "path.json", "path.csv", "viewpoints.csv"])
def test_flipped_bytes_end_in_one_line_or_a_problem(folder, name):
    content = (folder / name).read_bytes()
    rng = np.random.default_rng(5)
    for place in rng.integers(0, len(content), 12):
        spoilt = bytearray(content)
        spoilt[place] ^= 1 << int(rng.integers(0, 8))
        (folder / name).write_bytes(bytes(spoilt))
        try:
            assert not check_folder(folder).ok
        except PlannerError as error:
            assert "\n" not in str(error)  # noqa: PT017
