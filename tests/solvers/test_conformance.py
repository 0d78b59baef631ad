"""Every registered solver, built in or plugged in, must pass every check of the battery."""

import pytest

from solvers.registry import entries, families, load, require
from solvers.testing import CHECKS

EVERY = [entry for family in families() for entry in entries(family)]


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS.keys())
@pytest.mark.parametrize("entry", EVERY, ids=lambda entry: f"{entry.family}-{entry.name}")
def test_solver_keeps_its_contract(entry, check):
    solver = load(entry.family, entry.name)
    require(solver)  # a built-in solver that cannot run is a failure, never a skip
    check(solver, entry.family)
