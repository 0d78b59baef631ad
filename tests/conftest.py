"""Fixtures of the whole suite."""

import os
from collections import Counter
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real scans and instances, from ``SCANWRIGHT_DATA``."""
    folder = os.environ.get("SCANWRIGHT_DATA")
    if folder and Path(folder).is_dir():
        return Path(folder)
    reason = f"SCANWRIGHT_DATA={folder!r} is not a folder with the real data sets"
    if os.environ.get("SCANWRIGHT_REQUIRE_DATA") == "1":
        pytest.fail(reason)
    pytest.skip(reason)


def pytest_terminal_summary(terminalreporter):
    """Say which solvers ran how many checks of the conformance battery."""
    ran = Counter(
        solver
        for report in terminalreporter.getreports("passed")
        for name, solver in report.user_properties
        if name == "conformance"
    )
    if ran:
        terminalreporter.section("solvers that passed checks of the conformance battery")
        for solver, checks in sorted(ran.items()):
            terminalreporter.line(f"{solver:28} {checks}")
