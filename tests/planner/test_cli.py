"""The command: exit codes, one line for what the user can mend, and nothing left behind."""

import json
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from planner import cli


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["scanwright", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    return stopped.value.code


def town(rng, count=4000):
    """A box of 20 x 14 x 8 m on level ground, as points."""
    ground = np.column_stack([rng.uniform(-25, 25, (count, 2)), rng.normal(0, 0.02, count)])
    roof = np.column_stack(
        [rng.uniform(-10, 10, count), rng.uniform(-7, 7, count), np.full(count, 8.0)]
    )
    return np.vstack([ground, roof])


def xyz_file(path, points):
    np.savetxt(path, points, fmt="%.6f")
    return path


def empty(folder):
    (folder / "a.ply").touch()
    return folder / "a.ply"


def wrong_extension(folder):
    path = xyz_file(folder / "a.xyz", town(np.random.default_rng(0), 50))
    return path.rename(folder / "a.laz")


def truncated_laz(folder):
    import laspy

    cloud = laspy.create(point_format=3, file_version="1.2")
    cloud.header.scales = [0.001] * 3
    cloud.x, cloud.y, cloud.z = town(np.random.default_rng(0)).T
    cloud.write(str(folder / "whole.laz"))
    raw = (folder / "whole.laz").read_bytes()
    (folder / "cut.laz").write_bytes(raw[: len(raw) // 2])
    return folder / "cut.laz"


def not_finite(folder):
    points = town(np.random.default_rng(0), 200)
    points[::3] = np.nan
    points[1::3] = np.inf
    return xyz_file(folder / "a.xyz", points)


def three_points(folder):
    return xyz_file(folder / "a.xyz", np.eye(3))


def on_a_line(folder):
    return xyz_file(folder / "a.xyz", np.linspace(0, 1, 500)[:, None] * [30.0, 20.0, 10.0])


def flat_plane(folder):
    rng = np.random.default_rng(0)
    return xyz_file(
        folder / "a.xyz", np.column_stack([rng.random((4000, 2)) * 50.0, np.zeros(4000)])
    )


def no_faces(folder):
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    return folder / "a.obj"


def missing(folder):
    return folder / "none.ply"


def a_folder(folder):
    (folder / "scan.ply").mkdir()
    return folder / "scan.ply"


BROKEN = [
    empty,
    wrong_extension,
    truncated_laz,
    not_finite,
    three_points,
    on_a_line,
    flat_plane,
    no_faces,
    missing,
    a_folder,
]


@pytest.mark.parametrize("make", BROKEN, ids=lambda make: make.__name__)
def test_bad_input_is_one_line_that_names_the_file(make, tmp_path, monkeypatch, capfd):
    path = make(tmp_path)
    before = sorted(tmp_path.iterdir())
    assert run(monkeypatch, "plan", path, "--out", tmp_path / "plan") == 2
    lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("scanwright:")]
    assert len(lines) == 1
    assert str(path) in lines[0]
    assert ";" in lines[0]  # what is wrong; what to do
    assert sorted(tmp_path.iterdir()) == before


def test_settings_and_places_are_refused_before_any_work(tmp_path, monkeypatch, capfd):
    scan = xyz_file(tmp_path / "a.xyz", town(np.random.default_rng(0), 100))
    (tmp_path / "bad.toml").write_text("[route]\nsolvr = 'x'\n")
    (tmp_path / "taken").mkdir()
    for arguments, named in (
        (("--out", tmp_path / "plan", "--config", tmp_path / "bad.toml"), "route.solvr"),
        (("--out", tmp_path / "plan", "--set", "flight.speed=-1"), "flight.speed"),
        (("--out", tmp_path / "taken"), "exists already"),
        (("--out", tmp_path / "a.xyz" / "plan"), "a.xyz"),
    ):
        assert run(monkeypatch, "plan", scan, *arguments) == 2
        error = capfd.readouterr().err
        assert named in error
        assert "scene" not in error.split(named)[0]  # nothing was read yet
    assert not (tmp_path / "plan").exists()


@pytest.mark.parametrize("rows", ["", "x,y,z,yaw_deg,pitch_deg\n1,2,here,0,-90\n", None])
def test_bad_poses_of_the_first_flight_are_one_line_and_nothing_is_written(
    rows, tmp_path, monkeypatch, capfd
):
    scan = xyz_file(tmp_path / "a.xyz", town(np.random.default_rng(0)))
    poses = tmp_path / "poses.csv"
    if rows is not None:
        poses.write_text(rows)
    arguments = ("--out", tmp_path / "plan", "--set", f"scene.images={poses}")
    assert run(monkeypatch, "plan", scan, *arguments) == 2
    assert f"scanwright: {poses}: " in capfd.readouterr().err
    assert not (tmp_path / "plan").exists()


def test_an_unwritable_place_is_refused(tmp_path, monkeypatch, capfd):
    scan = xyz_file(tmp_path / "a.xyz", town(np.random.default_rng(0), 100))
    assert run(monkeypatch, "plan", scan, "--out", "/proc/plan") == 2  # not even root may
    assert "you may write to" in capfd.readouterr().err


def test_an_unknown_solver_is_named_before_the_plan_is_made(tmp_path, monkeypatch, capfd):
    scan = xyz_file(tmp_path / "a.xyz", town(np.random.default_rng(0), 100))
    arguments = ("plan", scan, "--out", tmp_path / "plan", "--set", "route.solver=two-optt")
    assert run(monkeypatch, *arguments) == 2
    assert "two-opt" in capfd.readouterr().err


@pytest.mark.slow
def test_a_house_is_planned_checked_and_told_as_json(tmp_path, monkeypatch, capfd):
    scan = xyz_file(tmp_path / "a.xyz", town(np.random.default_rng(0)))
    coarse = ("--set", "scale.radius_share=0.04")
    assert run(monkeypatch, "plan", scan, "--out", tmp_path / "plan", *coarse, "--json") == 0
    told = json.loads(capfd.readouterr().out)
    assert told["status"] == "complete"
    assert told["viewpoints"]["count"] > 10
    assert run(monkeypatch, "check", tmp_path / "plan", "--scene", scan, "--json") == 0
    assert json.loads(capfd.readouterr().out)["clearance"] >= told["airspace"]["d_min"] - 2e-4
    scan.write_text(scan.read_text() + "0 0 0\n")
    assert run(monkeypatch, "check", tmp_path / "plan", "--scene", scan) == 1


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), ("--set", "sorties.stations=[[-22.0,-20.0]]")])
def test_one_photo_is_a_plan(more, tmp_path, monkeypatch, capfd):
    scan = xyz_file(tmp_path / "a.xyz", town(np.random.default_rng(0)))
    few = ("--set", "scale.radius_share=0.08", "--set", "viewpoints.budget=1", *more)
    assert run(monkeypatch, "plan", scan, "--out", tmp_path / "plan", *few, "--json") in {0, 1}
    told = capfd.readouterr()
    numbers = json.loads(told.out)
    assert numbers["viewpoints"]["count"] == 1
    assert numbers["path"]["certified_clearance"] is None
    line = told.err.splitlines()[-1]
    assert ": 1 viewpoint, " in line
    assert ("certified clearance" in line) == bool(more)  # a sortie flies there and back
    assert run(monkeypatch, "check", tmp_path / "plan") == 0


@pytest.mark.slow
def test_flipped_normals_and_millimetres_give_the_plan_of_the_right_file(
    tmp_path, monkeypatch, capfd
):
    points = town(np.random.default_rng(0)) * 0.25  # 12.5 m across
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    counts = {}
    for name, scale, sign, more in (
        ("right", 1.0, 1.0, ()),
        ("flipped", 1.0, -1.0, ()),
        ("millimetres", 1000.0, 1.0, ("--set", "scene.unit=0.001")),
    ):
        path = tmp_path / f"{name}.ply"
        cloud = trimesh.PointCloud(points * scale)
        header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        header += "".join(f"property double {axis}\n" for axis in ("x", "y", "z", "nx", "ny", "nz"))
        path.write_bytes(
            (header + "end_header\n").encode()
            + np.hstack([cloud.vertices, sign * normals]).astype("<f8").tobytes()
        )
        coarse = ("--set", "scale.radius_share=0.04", "--json")
        code = run(monkeypatch, "plan", path, "--out", tmp_path / name, *coarse, *more)
        captured = capfd.readouterr()
        assert code == 0, captured.err
        counts[name] = json.loads(captured.out)["viewpoints"]["count"]
    assert counts["flipped"] == counts["right"]
    # Rounding sends the search elsewhere.
    assert abs(counts["millimetres"] - counts["right"]) <= 0.25 * counts["right"]


def test_solvers_are_listed(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["scanwright", "solvers", "list", "--json"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code in {0, None}
    listed = {(row["family"], row["name"]) for row in json.loads(capsys.readouterr().out)}
    assert {("cover", "greedy"), ("tour", "two-opt"), ("motion", "rrt-connect")} <= listed


def test_the_packages_load_no_back_end():
    code = (
        "import sys, planner, solvers, planner.cli\n"
        "heavy = {'numba', 'scipy', 'open3d', 'cvxpy', 'ompl', 'fcl', 'ortools', 'matplotlib'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
