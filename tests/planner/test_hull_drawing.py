"""What the overview shows of the airspace, and the mesh of the hull in a plan folder."""

import json
from dataclasses import replace

import numpy as np
import pytest

from planner import check_folder, load_config, plan, synthetic_scene
from planner.report.hull_lines import hull_drawing

pytestmark = pytest.mark.slow

SETTINGS = [
    "scale.radius_share=0.08",
    "seed=4",
    "viewpoints.objective=hits",
    "airspace.hull=stl",
    "airspace.zones=[{polygon=[[-3,-30],[3,-30],[3,30],[-3,30]],top=14.0}]",
    "sorties.stations=[[-30.0,-25.0]]",
    "sorties.method=split",
]


@pytest.fixture(scope="module")
def planned():
    scene = synthetic_scene(3, size=(42.0, 40.0), buildings=2, spacing=1.0)
    return plan(scene, load_config(None, SETTINGS))


@pytest.fixture(scope="module")
def drawing(planned):
    lost = np.array([[1.0, 2.0, 3.0]])
    return hull_drawing(planned.airspace, planned.scene.box, [planned.flight.path], lost)


def test_level_lines_lie_where_the_clearance_is_d_min(planned, drawing):
    assert len(drawing.levels) == len(drawing.lines) == 6
    assert any(drawing.lines)
    for level, lines in zip(drawing.levels, drawing.lines, strict=True):
        for line in lines:
            assert (line[:, 2] == level).all()
            clearance = planned.airspace.clearance_range(line)[0]
            assert np.median(np.abs(clearance - planned.scale.d_min)) < 0.1
            assert np.abs(clearance - planned.scale.d_min).max() < 2.0


def test_level_lines_end_where_the_scan_does(planned):
    box = planned.scene.box
    turn = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    small = replace(box, axes=turn @ box.axes, size=box.size * [0.6, 0.3, 1.0])
    d_min = planned.scale.d_min
    for area in (box, small):
        lines = np.vstack(sum(hull_drawing(planned.airspace, area, [], box.axes).lines, ()))
        beyond = np.abs((lines - area.centre) @ area.axes.T)[:, :2] - 0.5 * area.size[:2]
        assert beyond.max() <= d_min + 1e-9
        clearance = planned.airspace.clearance_range(lines)[0]
        assert np.median(np.abs(clearance - d_min)) < 0.1
    assert beyond.max() == pytest.approx(d_min)  # lines are cut at the side of the small box


def test_the_closest_place_is_that_of_the_whole_flight(planned, drawing):
    least = planned.airspace.clearance(planned.rows[:, 1:4])
    assert drawing.clearance <= least.min() + 0.05
    assert drawing.clearance >= planned.flight.path.clearance.min()
    assert planned.airspace.clearance(drawing.closest[None])[0] == drawing.clearance


def test_zones_are_drawn_with_their_edges(drawing):
    outlines = np.vstack(drawing.keep_out)
    assert not drawing.keep_in
    assert outlines[:, 2].max() == 14.0
    np.testing.assert_array_equal(np.abs(outlines[:, :2]).max(axis=0), [3.0, 30.0])


def test_without_a_flight_nothing_is_closest(planned):
    drawing = hull_drawing(planned.airspace, planned.scene.box, [], np.zeros((0, 3)))
    assert drawing.closest is None


def test_the_folder_holds_the_hull_on_request_and_the_picture_of_the_sorties(planned, tmp_path):
    import trimesh

    planned.save(tmp_path / "plan")
    files = json.loads((tmp_path / "plan" / "report.json").read_text())["files"]
    assert {"hull.stl", "overview.png"} <= set(files)
    mesh = trimesh.load(tmp_path / "plan" / "hull.stl", force="mesh")
    low, high = planned.airspace.bounds
    assert len(mesh.faces) > 500
    assert (mesh.bounds[0] >= low - 1.0).all()
    assert (mesh.bounds[1] <= high + 1.0 + planned.scale.d_min).all()
    assert check_folder(tmp_path / "plan").ok
    (tmp_path / "plan" / "hull.stl").write_bytes(b"")
    assert any("hull.stl" in problem for problem in check_folder(tmp_path / "plan").problems)
    planned.save(tmp_path / "plan", overwrite=True)
