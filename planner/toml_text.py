"""Plain values as TOML."""

import json
from typing import Any


def toml_of(tree: dict[str, Any]) -> str:
    """Write nested dicts of plain values as TOML, tables last as TOML wants it."""
    lines = [
        f"{key} = {toml_value(value)}" for key, value in tree.items() if not isinstance(value, dict)
    ]
    for key, table in tree.items():
        if isinstance(table, dict):
            lines += ["", f"[{key}]"]
            lines += [f"{name} = {toml_value(value)}" for name, value in table.items()]
    return "\n".join(lines) + "\n"


def toml_value(value: Any) -> str:
    """One TOML value; a dict becomes an inline table."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    # TOML's text, numbers and booleans are JSON's, but for surrogate pairs and the delete character
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
