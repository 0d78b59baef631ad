"""What is imported is asked for by name."""

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

ROOT = Path(__file__).parents[1]
OWN = {"planner", "solvers"}


def imported():
    """Packages that the sources import, anywhere in a file, but for the standard library."""
    found = set()
    for file in (path for name in OWN for path in (ROOT / name).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.split(".")[0])
    return found - OWN - sys.stdlib_module_names


def test_every_imported_package_is_a_declared_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = [*project["dependencies"]]
    for extra in project["optional-dependencies"].values():
        asked += extra
    declared = {re.match(r"[\w.-]+", line)[0].lower() for line in asked}
    providers = packages_distributions()
    here = sorted(imported() & providers.keys())
    assert {"numpy", "matplotlib", "contourpy"} <= set(here)
    missing = [name for name in here if not declared & {p.lower() for p in providers[name]}]
    assert missing == []
