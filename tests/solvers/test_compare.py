"""Tables of solvers whose every step is known, and of solvers that fail."""

import csv
import io
import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import pytest
from typer.testing import CliRunner

from planner.cli import app
from planner.errors import PlannerError
from solvers import InvalidProblem, Status, Stop
from solvers.cases import cases, entrants
from solvers.compare import Case, compare, label_of
from solvers.curves import anytime
from solvers.tour import TourProblem
from solvers.tour.two_opt import TwoOpt

LINE = TourProblem(np.abs(np.subtract.outer(np.arange(6.0), np.arange(6.0))))
"""Six places on a line: the shortest closed tour is 10 long."""


@dataclass(frozen=True)
class Script:
    """Offers the orders that it is told to, an iteration each; the seed says where it begins."""

    orders: tuple = ((0, 2, 4, 1, 3, 5), (0, 2, 1, 3, 4, 5), (0, 1, 2, 3, 4, 5))
    bound: float = 8.0
    name = "script"

    def run(self, problem, run):
        run.bound = self.bound
        for order in self.orders[run.seed :]:
            if not run.proceed():
                break
            run.offer(np.array(order))
        return Status.FEASIBLE


@dataclass(frozen=True)
class Crashes:
    name = "crashes"

    def run(self, problem, run):
        raise ZeroDivisionError("on | purpose")


@dataclass(frozen=True)
class Needy(Crashes):
    name = "needy"
    requires = ("no_such_package_at_all",)


@dataclass(frozen=True)
class PressesCtrlC(Crashes):
    name = "presses ctrl-c"
    early: bool = False

    def run(self, problem, run):
        run.offer(np.arange(problem.size))
        if self.early or problem is LINE:
            raise KeyboardInterrupt


def spawned(workers):
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))


def test_a_row_holds_mean_spread_and_extremes_over_the_seeds():
    table = compare({"line": LINE}, [Script(((0, 2, 4, 1, 3, 5), (0, 2, 1, 3, 4, 5)))], (0, 1))
    (row,) = table.rows
    assert (row.instance, row.runs, row.solved, row.status) == ("line", 2, 2, "feasible")
    assert (row.cost, row.spread, row.least, row.most) == (12, 0, 12, 12)
    table = compare([Case("line", LINE, 10.0)], [Script()], (0, 1, 2), Stop(iterations=1))
    (row,) = table.rows
    assert (row.least, row.most, row.best_known) == (10, 16, 10)
    assert row.cost == pytest.approx(38 / 3)
    assert row.spread == pytest.approx(np.std([16, 12, 10]))
    assert row.gap_to_best == pytest.approx(np.mean([0.6, 0.2, 0.0]))
    assert row.gap == pytest.approx(np.mean([8 / 16, 4 / 12, 2 / 10]))
    assert (row.bound, row.iterations) == (8, 1)
    assert row.stop_reason == "iterations / finished"


def test_without_a_known_best_the_best_found_is_the_measure():
    table = compare({"line": LINE}, {"good": Script(), "poor": Script(Script().orders[:1])})
    assert [row.gap_to_best for row in table.rows] == [0.0, pytest.approx(0.6)]
    below = compare({"line": LINE}, [Script()], best_known={"line": 12.5})
    assert below.rows[0].gap_to_best == pytest.approx(-0.2)


def test_who_is_missing_crashes_or_refuses_is_a_row_with_its_reason():
    lopsided = TourProblem(np.triu(LINE.costs))
    table = compare(
        {"line": LINE, "lopsided": lopsided},
        [Script(bound=0.0), Crashes(), Needy(), "two-opt", "no_such_module:Thing"],
    )
    reasons = {(row.instance, row.solver): row.reason for row in table.rows}
    assert len(reasons) == 10
    assert reasons["line", "script bound=0.0"] == reasons["line", "two-opt"] == ""
    assert "ZeroDivisionError" in reasons["line", "crashes"]
    assert "pip install no_such_package_at_all" in reasons["line", "needy"]
    assert "asymmetric" in reasons["lopsided", "two-opt"]
    assert "no_such_module" in reasons["line", "no_such_module:Thing"]
    text = table.markdown()
    assert "| line | crashes | not run |" in text
    assert "- needy on lopsided: solver 'needy' needs no_such_package_at_all" in text
    assert [line.solved for line in table.standings] == [2, 0, 0, 1, 0]


@pytest.mark.slow
def test_processes_change_nothing_but_the_seconds():
    problems = cases("tour", ["random:20:0-1"]) + cases("motion", ["boxes:4"])
    race = problems, ["nearest", "two-opt", "rrt-connect"], range(2), Stop(iterations=300)
    with spawned(2) as pool:
        spread = compare(*race, map=pool.map)
    alone = compare(*race)
    assert len(alone.rows) == 9
    for a, b in zip(alone.rows, spread.rows, strict=True):
        nowhen = {"seconds": 0.0, "seconds_spread": 0.0}
        assert repr(replace(a, **nowhen)) == repr(replace(b, **nowhen))
    assert sum(bool(row.reason) for row in alone.rows) == 4  # tours for a planner, and the reverse
    for a, b in zip(alone.trials, spread.trials, strict=True):
        if a.result is not None:
            assert [p.cost for p in a.result.trace] == [p.cost for p in b.result.trace]


@pytest.mark.slow
def test_a_process_that_dies_is_a_reason(tmp_path, monkeypatch):
    dies = "    def run(self, problem, run):\n        import os\n        os._exit(7)\n"
    (tmp_path / "dying.py").write_text(f"class Dies:\n    name = 'dies'\n{dies}")
    monkeypatch.syspath_prepend(tmp_path)
    with spawned(1) as pool:
        table = compare({"line": LINE}, ["nearest", "dying:Dies"], map=pool.map)
    assert [bool(row.reason) for row in table.rows] == [False, True]
    assert "a process died" in table.rows[1].reason
    assert not table.interrupted


def test_ctrl_c_ends_the_race_and_keeps_what_was_run():
    seen = []
    table = compare({"line": LINE}, [Script(), PressesCtrlC(), "nearest"], listener=seen.append)
    assert table.interrupted
    assert [row.solver for row in table.rows] == ["script", "presses ctrl-c"]
    assert [trial.solver for trial in seen] == ["script", "presses ctrl-c"]
    assert table.rows[1].cost == 10


def test_ctrl_c_while_a_solver_warms_up_ends_the_race_too():
    table = compare({"line": LINE}, [Script(), PressesCtrlC(early=True), "nearest"])
    assert table.interrupted
    assert [row.solver for row in table.rows] == ["script"]


def test_a_target_alone_does_not_end_a_race_for_the_best():
    with pytest.raises(InvalidProblem, match="another limit"):
        compare({"line": LINE}, ["two-opt"], stop=Stop(target=1.0), until_best=True)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"seeds": [1.5]}, "seed"),
        ({"best_known": {"line": "many"}}, "no number"),
        ({"best_known": {"line": np.nan}}, "no number"),
        ({"problems": {"line": 5}}, "no problem of any family"),
    ],
)
def test_bad_words_are_refused_before_the_race(change, told):
    given = {"problems": {"line": LINE}, "solvers": ["nearest"], **change}
    with pytest.raises(InvalidProblem, match=told):
        compare(**given)


def test_numbers_of_numpy_are_numbers():
    table = compare({"line": LINE}, ["nearest"], np.arange(2), best_known={"line": np.float32(10)})
    assert json.loads(table.json())["rows"][0]["best_known"] == 10.0
    assert Stop(iterations=5.0).iterations == 5


def test_outputs_that_cannot_be_written_are_refused_before_the_race(tmp_path):
    for words in (["--csv", str(tmp_path / "no" / "x.csv")], ["--plot", str(tmp_path / "x.foo")]):
        done = CliRunner().invoke(app, ["solvers", "compare", "tour", "random:5", *words])
        assert isinstance(done.exception, PlannerError)
        assert not list(tmp_path.iterdir())


def test_csv_and_json_say_the_same_and_no_number_is_made_up():
    table = compare([Case("a, b", LINE, 10.0)], [Script(), Crashes()], (0, 1))
    rows = list(csv.DictReader(io.StringIO(table.csv())))
    content = json.loads(table.json())
    assert [row["instance"] for row in rows] == ["a, b", "a, b"]
    assert float(rows[0]["cost"]) == content["rows"][0]["cost"] == 10.0
    assert (rows[1]["cost"], rows[1]["bound"]) == ("", "")
    assert content["rows"][1]["cost"] is None
    assert content["trials"][0]["trace"][-1]["cost"] == 10.0
    assert [trial["seed"] for trial in content["trials"]] == [0, 1, 0, 1]
    assert content["machine"] == table.machine


def test_markdown_is_a_table_whatever_the_names_are():
    table = compare({"a|b": LINE, "c": LINE}, [Script()])
    lines = table.markdown().splitlines()
    assert lines[2].startswith("| a\\|b | script | feasible | 10 | 0 | 8 | 20.00 % | 0.00 % |")
    assert lines[5].startswith("| solver | solved | proven |")
    assert lines[7].startswith("| script | 2/2 | 0 | 20.00 % | 0.00 % | 0.00 % |")
    assert lines[-1].startswith("Machine: ")


def test_anytime_curves_are_the_mean_of_steps():
    table = compare([Case("line", LINE, 10.0)], [Script()], (0, 1))
    at, gap = anytime(table, "script", "iterations")
    np.testing.assert_array_equal(at, [1, 2, 3])
    np.testing.assert_allclose(gap, [(0.6 + 0.2) / 2, (0.2 + 0.0) / 2, 0.0])
    seconds, same = anytime(table, "script", "seconds")
    assert (np.diff(seconds) > 0).all()
    assert same[-1] == 0.0
    assert len(anytime(table, "nobody", "seconds")[0]) == 0


@pytest.mark.parametrize(("suffix", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_curves_are_drawn_in_the_format_of_the_suffix(tmp_path, suffix, magic):
    path = tmp_path / f"curves.{suffix}"
    compare({"line": LINE}, [Script(), Crashes()]).plot(path)
    assert path.read_bytes().startswith(magic)


def test_labels_say_what_is_not_the_default():
    assert label_of(TwoOpt()) == "two-opt"
    assert label_of(TwoOpt(neighbours=5)) == "two-opt neighbours=5"


@pytest.mark.parametrize(
    ("race", "message"),
    [
        (({}, ["nearest"]), "at least one"),
        (({"a": LINE}, []), "at least one"),
        (({"a": LINE}, ["nearest"], []), "at least one"),
        (({"a": LINE}, "nearest"), "one text"),
        (({"a": LINE}, [Script(), Script()]), "two solvers"),
        (([Case("a", LINE), Case("a", LINE)], ["nearest"]), "two instances"),
    ],
)
def test_what_is_no_comparison_is_refused(race, message):
    with pytest.raises(InvalidProblem, match=message):
        compare(*race)


def test_a_run_until_the_best_known_ends_there():
    race = cases("tour", ["random:60"]), ["iterated-local-search"]
    known, few = {race[0][0].name: 1e6}, Stop(iterations=50)
    row = compare(*race, stop=few, best_known=known, until_best=True).rows[0]
    assert (row.stop_reason, row.iterations < 50) == ("target", True)
    row = compare(*race, stop=few, until_best=True).rows[0]  # none is known
    assert row.stop_reason == "iterations"
    with pytest.raises(InvalidProblem, match="another limit"):
        compare(*race, best_known=known, until_best=True)


def test_files_bring_their_best_known_cost(tmp_path):
    head = "NAME: tiny\nTYPE: TSP\nDIMENSION: 4\nEDGE_WEIGHT_TYPE: EUC_2D\nNODE_COORD_SECTION\n"
    (tmp_path / "tiny.tsp").write_text(head + "1 0 0\n2 0 3\n3 4 3\n4 4 0\nEOF\n")
    (case,) = cases("tour", [str(tmp_path / "tiny.tsp")])
    assert (case.name, case.problem.size, case.best_known) == ("tiny", 4, None)
    for listed in ({"tiny": 14}, {"instances": {"tiny": {"best_known": 14}, "other": {}}}):
        (tmp_path / "best_known.json").write_text(json.dumps(listed))
        (case,) = cases("tour", [str(tmp_path / "tiny.tsp")])
        assert case.best_known == 14.0
    for broken in ("[1]", "{", '{"tiny": "x"}x'):
        (tmp_path / "best_known.json").write_text(broken)
        with pytest.raises(InvalidProblem, match="best known"):
            cases("tour", [str(tmp_path / "tiny.tsp")])


def test_generators_repeat_and_take_ranges_of_seeds():
    for family, word in (("tour", "random:9:3"), ("cover", "random:50:3"), ("motion", "boxes:3:3")):
        first, again = cases(family, [word]), cases(family, [word])
        assert first[0].name == again[0].name == f"{word.split(':')[0]}-{word.split(':')[1]}-3"
        assert repr(first[0].problem) == repr(again[0].problem)
    assert [case.name for case in cases("tour", ["random:5:2-4"])] == [
        f"random-5-{seed}" for seed in (2, 3, 4)
    ]
    for family in ("cover", "pairs", "tour", "motion"):
        assert len(cases(family, [])) == 1


@pytest.mark.parametrize("word", ["missing.tsp", "random", "random:x", "nothing:5", "boxes:3"])
def test_what_is_neither_file_nor_generator_is_refused(word):
    with pytest.raises(InvalidProblem, match=r"random:100"):
        cases("tour", [word])
    with pytest.raises(InvalidProblem, match="cover, pairs, tour"):
        cases("parking", [word])


def test_solvers_take_parameters_in_words():
    named = entrants("tour", ["two-opt neighbours=5", "nearest"])
    assert named["two-opt neighbours=5"] == TwoOpt(neighbours=5)
    assert entrants("tour", ["ortools metaheuristic=TABU_SEARCH"]).popitem()[1].metaheuristic
    assert {"nearest", "two-opt", "ortools"} <= set(entrants("tour", []))
    for wrong in ("two-opt neighbours", "two-opt 5=5", "two-opt near=5", "two-optt", ""):
        with pytest.raises(InvalidProblem):
            entrants("tour", [wrong])


def test_the_command_prints_writes_and_draws(tmp_path):
    words = ["solvers", "compare", "tour", "random:12:1-2", "--solver", "nearest"]
    files = [f"--{kind}={tmp_path / kind}" for kind in ("csv", "markdown")]
    plot = tmp_path / "curves.png"
    done = CliRunner().invoke(app, [*words, *files, "--plot", str(plot), "--iterations", "5"])
    assert done.exit_code == 0, done.output
    assert done.stdout == (tmp_path / "markdown").read_text() + "\n"
    assert len((tmp_path / "csv").read_text().splitlines()) == 3
    assert plot.stat().st_size > 1000
    done = CliRunner().invoke(app, [*words, "--json", "--seeds", "2"])
    assert len(json.loads(done.stdout)["trials"]) == 4


def test_the_command_says_what_is_wrong_in_one_line():
    for words in (["parking"], ["tour", "nowhere.tsp"], ["tour", "--seconds", "-1"]):
        done = CliRunner().invoke(app, ["solvers", "compare", *words])
        assert isinstance(done.exception, PlannerError), words


def test_the_command_races_real_instances(shared_data):
    folder = shared_data / "optimisation" / "tsplib"
    words = ["solvers", "compare", "tour", str(folder / "berlin52.tsp"), "--solver", "two-opt"]
    done = CliRunner().invoke(app, [*words, "--json"])
    (row,) = json.loads(done.stdout)["rows"]
    assert (row["instance"], row["best_known"]) == ("berlin52", 7542)
    assert row["gap_to_best"] == pytest.approx(row["cost"] / 7542 - 1)
    assert row["gap_to_best"] >= 0
