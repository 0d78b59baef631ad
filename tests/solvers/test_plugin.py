"""A solver in somebody else's wheel is listed, raced and tested like our own, with no edit."""

import base64
import hashlib
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from solvers.testing import CHECKS

ROOT = Path(__file__).parents[2]

MODULE = '''
"""Somebody else's solvers."""

from dataclasses import dataclass

from solvers import Status


@dataclass(frozen=True)
class Shuffle:
    """Shuffle until told to stop, and keep the ends where they belong."""

    name = "shuffle"

    def run(self, problem, run):
        while run.proceed():
            order = [int(place) for place in run.rng.permutation(problem.size)]
            for place, at in ((problem.start, 0), (problem.end, len(order))):
                if place is not None:
                    order.remove(place)
                    order.insert(at, place)
            run.offer(order)
        return Status.FEASIBLE
'''


def build_wheel(folder):
    """A wheel as the packaging standard describes it, by hand: nothing else need be installed."""
    meta = "others_solvers-1.0.dist-info"
    files = {
        "others_solvers.py": MODULE,
        f"{meta}/METADATA": "Metadata-Version: 2.1\nName: others-solvers\nVersion: 1.0\n",
        f"{meta}/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{meta}/entry_points.txt": "[solvers.tour]\nshuffle = others_solvers:Shuffle\n",
    }
    record = [
        f"{name},sha256={digest(content)},{len(content.encode())}"
        for name, content in files.items()
    ]
    files[f"{meta}/RECORD"] = "\n".join([*record, f"{meta}/RECORD,,", ""])
    path = folder / "others_solvers-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as wheel:
        for name, content in files.items():
            wheel.writestr(name, content)
    return path


def digest(content):
    binary = hashlib.sha256(content.encode()).digest()
    return base64.urlsafe_b64encode(binary).rstrip(b"=").decode()


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Environment in which the wheel is installed beside everything that this test has."""
    folder = tmp_path_factory.mktemp("plugin")
    target, wheel = folder / "site", build_wheel(folder)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--target", str(target), str(wheel)], check=True)
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    return kept | {"PYTHONPATH": str(target), "PYTHONDONTWRITEBYTECODE": "1"}


def scanwright(env, *words):
    code = "from planner.cli import main; main()"
    command = [sys.executable, "-c", code, "solvers", *words]
    done = subprocess.run(command, env=env, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_it_is_listed(installed):
    rows = json.loads(scanwright(installed, "list", "--json"))
    (row,) = (row for row in rows if row["name"] == "shuffle")
    assert row == {
        "family": "tour",
        "name": "shuffle",
        "source": "others_solvers:Shuffle",
        "available": True,
        "missing": "",
        "summary": "Shuffle until told to stop, and keep the ends where they belong.",
    }
    assert "[others_solvers:Shuffle]" in scanwright(installed, "list")


@pytest.mark.slow
def test_it_is_raced_by_name_and_with_all_others(installed):
    race = ["compare", "tour", "random:8", "--iterations", "50", "--json"]
    named = json.loads(scanwright(installed, *race, "--solver", "shuffle", "--solver", "nearest"))
    assert [row["solver"] for row in named["rows"]] == ["shuffle", "nearest"]
    assert named["rows"][0]["status"] == "feasible"
    assert named["rows"][0]["reason"] == ""


@pytest.mark.slow
def test_it_runs_the_battery_of_this_project(installed):
    battery = ["tests/solvers/test_conformance.py", "-k", "tour-shuffle", "-q", "-p", "no:xdist"]
    command = [sys.executable, "-m", "pytest", *battery, "-p", "no:cacheprovider"]
    done = subprocess.run(
        command, env=installed, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("tour shuffle "))
    assert int(line.split()[-1]) == len(CHECKS)
