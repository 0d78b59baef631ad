"""One setting on the command line, such as ``route.solver=ortools``."""

import tomllib
from typing import Any

from planner.errors import PlannerError


def assign(tree: dict[str, Any], assignment: str) -> tuple[str, ...]:
    """Put one ``table.key=value`` into the tree of settings; return its keys."""
    key, equals, text = assignment.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise PlannerError(
            f"--set {assignment}: is no assignment; write it as route.solver=ortools"
        )
    try:
        read = tomllib.loads(f"value = {text.strip()}")
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        if text.strip()[:1] in {"[", "{", '"', "'"}:
            raise PlannerError(
                f"--set {key.strip()}: its value is not valid TOML ({error}); "
                "mend it, and put text in quotes"
            ) from None
        read = {"value": text.strip()}
    if len(read) > 1:
        raise PlannerError(f"--set {key}: sets more than one value; write one assignment each")
    value = read["value"]
    for part in parts[:-1]:
        tree = tree.setdefault(part, {})
        if not isinstance(tree, dict):
            raise PlannerError(f"--set {assignment}: {part} is a value and has no keys of its own")
    tree[parts[-1]] = value
    return tuple(parts)
