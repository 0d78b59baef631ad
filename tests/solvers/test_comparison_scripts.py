"""The scripts that print the tables of the documentation, on small sizes."""

import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).parents[2] / "docs" / "comparisons"


def printed(script, *words):
    command = [sys.executable, str(SCRIPTS / script), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def cells(text):
    return [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]


def test_covers_are_compared_and_no_bound_is_above_a_cost():
    text = printed("covers.py", 0.1, 1, 60)
    assert text.count("\n## ") == 5
    rows = [row for row in cells(text) if len(row) == 10 and row[2] in {"optimal", "feasible"}]
    assert {row[1] for row in rows} >= {"greedy", "lagrangian", "local-search", "cvxpy", "cp-sat"}
    assert all(float(row[5]) <= float(row[3]) for row in rows)
    proven = [row for row in rows if row[0].startswith("planted") and row[1] == "cvxpy"]
    assert [row[2] for row in proven] == ["optimal", "optimal"]


def test_the_tables_of_the_paper_are_printed_and_drawn(tmp_path):
    picture = tmp_path / "convergence.png"
    rows = cells(printed("tours.py", 0.2, 50, picture))
    small = [row for row in rows if row[0].isdigit() and int(row[0]) <= 12]
    assert [(row[0], row[1]) for row in small[:2]] == [
        ("7", "branch-and-bound"),
        ("7", "ant-colony"),
    ]
    for proven, colony in zip(small[::2], small[1::2], strict=True):
        assert (proven[7], proven[6]) == ("optimal", "0.00")
        assert float(proven[5]) <= float(colony[5])
    assert [row[1] for row in rows if row[0] == "50"] == ["particle-swarm", "ant-colony", "auto"]
    assert picture.stat().st_size > 10_000
