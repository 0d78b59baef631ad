"""The manual of all settings, from their declarations: as a page, as TOML and as records."""

import re
from collections.abc import Iterator
from textwrap import wrap
from typing import Any

from pydantic.fields import FieldInfo

from planner.config import Config
from planner.settings import Settings, bounds_of, is_table, range_of, table_of, takes, unit_of
from planner.toml_text import toml_value

_HEAD = """\
# Settings

What each setting takes, its default, its unit and what it does. None has to be set. One that is
*unset* follows from others; the plan says how while it is made, and in its `config.toml`.

Name a file of settings with `--config`, or give single ones with `--set`:

```sh
scanwright settings --toml > scan.toml
scanwright plan SCAN.laz --out my-plan --config scan.toml --set flight.speed=6
```

The first line writes all defaults with comments, to change or delete as you like. This page is what
`scanwright settings` prints; `--json` prints it for programs.
"""


def page() -> str:
    """All settings as a page of Markdown, a section each table."""
    lines = [_HEAD]
    for name, table in _tables():
        lines += [f"## {_title(name)}", "", _about(table), ""]
        lines += ["| setting | takes | default | what it does |", "|---|---|---|---|"]
        for row in _rows(name, table):
            cells = f"**{_key(row)}**", _ticked(_said(row)), _default(row), row["does"]
            lines.append(f"| {' | '.join(cells)} |")
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def records() -> list[dict[str, Any]]:
    """One plain row each setting, ready for JSON.

    Keys: ``name`` (with its table), ``takes`` (in words, with the range), ``range``, ``unit``,
    ``default`` (``None`` if unset), ``required`` (in each zone) and ``does``.
    """
    return [row for name, table in _tables() for row in _rows(name, table)]


def template() -> str:
    """All defaults as TOML that can be read, each below what it does; unset ones as comments."""
    lines = ["# All settings of scanwright with their defaults."]
    for name, table in _tables():
        listed = name.endswith("[]")
        if name:
            lines += ["", *_comment(_about(table))]
            lines.append(f"# [[{name[:-2]}]]" if listed else f"[{name}]")
        for row in _rows(name, table):
            lines += ["", *_comment(f"{row['does']} It takes {_said(row)}.")]
            if row["takes"] != "a list of tables":
                value = "..." if row["default"] is None else toml_value(row["default"])
                hidden = listed or row["default"] is None
                lines.append(f"{'# ' if hidden else ''}{_key(row)} = {value}")
    return "\n".join(lines) + "\n"


def _comment(text: str) -> list[str]:
    """Text as comments of TOML, without marks around its literals."""
    return [f"# {line}" for line in wrap(text.replace("`", ""), 97)]


def _tables() -> Iterator[tuple[str, type[Settings]]]:
    """Every table with its name; lists of tables end in ``[]`` and follow what holds them."""
    yield "", Config
    for name, field in Config.model_fields.items():
        table = table_of(field.annotation)
        if table is not None:
            yield name, table
            for key, inner in table.model_fields.items():
                item = table_of(inner.annotation)
                if item is not None:
                    yield f"{name}.{key}[]", item


def _rows(name: str, table: type[Settings]) -> list[dict[str, Any]]:
    """Settings of a table that are no tables themselves."""
    return [
        _row(f"{name}.{key}".lstrip("."), field)
        for key, field in table.model_fields.items()
        if not is_table(field.annotation)
    ]


def _row(name: str, field: FieldInfo) -> dict[str, Any]:
    default = None if field.is_required() else field.default
    return {
        "name": name,
        "takes": takes(field.annotation, field.metadata),
        "range": range_of(bounds_of(field.metadata)),
        "unit": unit_of(field),
        "default": list(default) if isinstance(default, tuple) else default,
        "required": field.is_required(),
        "does": _plain(field.description),
    }


def _title(name: str) -> str:
    if not name:
        return "Before all tables"
    return f"`[[{name[:-2]}]]`" if name.endswith("[]") else f"`[{name}]`"


def _about(table: type[Settings]) -> str:
    """What a table is about."""
    return _plain(table.__doc__)


def _plain(text: str | None) -> str:
    """Documentation in one line, literals marked as Markdown does."""
    return " ".join((text or "").split()).replace("``", "`")


def _key(row: dict[str, Any]) -> str:
    return str(row["name"]).rpartition(".")[2]


def _said(row: dict[str, Any]) -> str:
    """What a setting takes, with its unit."""
    return f"{row['takes']} ({row['unit']})" if row["unit"] else str(row["takes"])


def _default(row: dict[str, Any]) -> str:
    if row["required"]:
        return "*required*"
    return "*unset*" if row["default"] is None else f"`{toml_value(row['default'])}`"


def _ticked(text: str) -> str:
    """Text with its quoted choices marked as literals."""
    return re.sub(r'("[^"]*")', r"`\1`", text)
