"""A plan folder appears whole or not at all."""

import numpy as np
import pytest

from planner.errors import PlannerError
from planner.missions.folder import refuse_folder, whole_folder
from planner.missions.tables import (
    read_path_table,
    read_viewpoints,
    write_path_table,
    write_viewpoints,
)
from planner.viewpoints.viewpoints import Viewpoints


def write_plan(folder, text="1", *, overwrite=False):
    with whole_folder(folder, overwrite=overwrite) as draft:
        (draft / "report.json").write_text(text)


def test_a_failure_leaves_nothing_behind(tmp_path):
    def fail():
        with whole_folder(tmp_path / "a" / "plan") as draft:
            (draft / "report.json").write_text("half")
            raise RuntimeError("disk on fire")

    with pytest.raises(RuntimeError):
        fail()
    assert list((tmp_path / "a").iterdir()) == []


def test_an_earlier_plan_is_kept_unless_it_may_be_replaced(tmp_path):
    plan = tmp_path / "plan"
    write_plan(plan, "first")
    with pytest.raises(PlannerError, match="--overwrite"):
        write_plan(plan, "second")
    assert (plan / "report.json").read_text() == "first"
    write_plan(plan, "second", overwrite=True)
    assert (plan / "report.json").read_text() == "second"
    assert [entry.name for entry in tmp_path.iterdir()] == ["plan"]


def test_a_failed_replacement_keeps_the_earlier_plan(tmp_path):
    plan = tmp_path / "plan"
    write_plan(plan, "first")

    def fail():
        with whole_folder(plan, overwrite=True):
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert (plan / "report.json").read_text() == "first"
    assert [entry.name for entry in tmp_path.iterdir()] == ["plan"]


def test_a_folder_of_other_things_is_never_replaced(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(PlannerError, match="left alone"):
        refuse_folder(tmp_path, overwrite=True)


def test_a_file_and_a_place_under_a_file_are_refused(tmp_path):
    (tmp_path / "file").write_text("x")
    for target in (tmp_path / "file", tmp_path / "file" / "plan"):
        with pytest.raises(PlannerError, match="file"):
            refuse_folder(target, overwrite=False)


def some_viewpoints():
    return Viewpoints(
        np.array([[0.0, -1e-9, 5.25], [1.5, 2.0, 6.125]]),
        np.array([90.0, -12.5]),
        np.array([-90.0, 0.0]),
        ("cover", "local"),
        np.array([-1, 3]),
    )


def test_viewpoints_survive_their_table(tmp_path):
    viewpoints = some_viewpoints()
    path = tmp_path / "viewpoints.csv"
    write_viewpoints(path, viewpoints)
    assert path.read_text().splitlines()[0] == "index,x,y,z,dx,dy,dz,yaw_deg,pitch_deg,kind"
    assert "-0.0000" not in path.read_text()
    back = read_viewpoints(path)
    np.testing.assert_allclose(back.positions, viewpoints.positions, atol=5e-5)
    np.testing.assert_allclose(back.yaw_deg, viewpoints.yaw_deg, atol=5e-5)
    assert back.kind == viewpoints.kind


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda lines: lines[:1] + lines[2:], "line 2"),
        (lambda lines: ["x,y,z", *lines[1:]], "line 1"),
        (lambda lines: [*lines[:2], lines[2].replace("1.5000", "1.5OOO")], "line 3"),
        (lambda lines: [*lines[:2], lines[2].replace("1.5000", "inf")], "line 3"),
        (lambda lines: [*lines[:2], lines[2][:10]], "line 3"),
        (lambda lines: [*lines[:2], lines[2].replace("-12.5000", "12.5000")], "line 3"),
    ],
)
def test_a_broken_line_is_named(tmp_path, change, complaint):
    path = tmp_path / "viewpoints.csv"
    write_viewpoints(path, some_viewpoints())
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")
    with pytest.raises(PlannerError, match=complaint) as caught:
        read_viewpoints(path)
    assert str(path) in str(caught.value)


def test_the_path_table_survives(tmp_path):
    rows = np.column_stack([np.random.default_rng(0).normal(size=(50, 6)), np.arange(50)])
    write_path_table(tmp_path / "path.csv", rows)
    np.testing.assert_allclose(read_path_table(tmp_path / "path.csv"), rows, atol=5.1e-5)
