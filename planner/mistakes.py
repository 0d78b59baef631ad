"""What is wrong with settings, in one plain line that says what is allowed."""

import math
import types
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Union, get_args, get_origin

from pydantic import ValidationError

from planner.settings import Settings, is_table, plain, table_of, takes, unit_of

_LONGEST = 60  # characters of a value that are shown
_MOST = 4  # settings that are suggested
_LISTED = 12  # settings of a table that are listed
_NEAR = 0.7  # likeness of a setting of the same table that is suggested
_ALIKE = 0.85  # the same of another table
_ALL = "scanwright settings lists all"


def first_mistake(error: ValidationError, root: type[Settings]) -> tuple[tuple[Any, ...], str]:
    """Say the first thing that is wrong with settings, and how to mend it.

    Parameters
    ----------
    error
        What pydantic found.
    root
        The table that was read.

    Returns
    -------
    keys, sentence
        Keys and rows that lead to the fault, and one line that names it as ``table.key`` with
        the value given and what is allowed.

    """
    fault = error.errors(include_url=False)[0]
    what, where, given = fault["type"], fault["loc"], fault["input"]
    if what == "missing" and isinstance(where[-1], int):
        what, where = "too_short", where[:-1]  # a point with too few numbers
    place = _find(root, where)
    if what == "extra_forbidden":
        sentence = _unknown(root, place, str(where[-1]), given)
    elif what == "missing":
        sentence = f"setting {place.name} is missing; give {place.allowed}"
    elif what == "value_error":
        sentence = f"{place.name}: {fault['ctx']['error']}".removeprefix(": ")
    else:
        sentence = (
            f"setting {place.name} = {_shown(given)} is refused: it must be "
            f"{place.allowed_for(given)}; change or remove it"
        )
    return place.keys, sentence


@dataclass(frozen=True, slots=True)
class _Place:
    """A setting, an item of one, or an unknown key in a table.

    Parameters
    ----------
    keys
        Keys and rows that lead there.
    kind
        Its type; of an unknown key, that of the table it is in.
    limits
        What else pydantic knows of it.
    unit
        Its unit, if it has one.

    """

    keys: tuple[Any, ...]
    kind: Any
    limits: Sequence[Any] = ()
    unit: str = ""

    @property
    def name(self) -> str:
        """The way there, such as ``sorties.stations[0]``."""
        return "".join(
            f"[{key}]" if isinstance(key, int) else f".{key}" for key in self.keys
        ).lstrip(".")

    @property
    def allowed(self) -> str:
        """What it takes."""
        if is_table(self.kind):
            return f"a table of settings such as {', '.join(list(self.kind.model_fields)[:3])}"
        words = takes(self.kind, self.limits)
        return f"{words} ({self.unit})" if self.unit else words

    def allowed_for(self, value: Any) -> str:
        """What it takes; that a number is finite goes without saying unless one is not."""
        endless = isinstance(value, float) and not math.isfinite(value)
        return self.allowed.replace("a number", "a finite number") if endless else self.allowed


def _find(root: type[Settings], where: Sequence[Any]) -> _Place:
    """Follow keys and rows as far as they lead; after that pydantic names parts of unions."""
    place = _Place((), root)
    for key in where:
        kind = _without_none(plain(place.kind)[0])
        keys = (*place.keys, key)
        if is_table(kind):
            field = kind.model_fields.get(str(key))
            if field is None:
                return _Place(keys, kind)
            place = _Place(keys, field.annotation, field.metadata, unit_of(field))
        elif get_origin(kind) is tuple and isinstance(key, int):
            items = get_args(kind)
            place = _Place(keys, items[0] if Ellipsis in items else items[key], (), place.unit)
        else:
            break
    return place


def _without_none(kind: Any) -> Any:
    """The other part of ``X | None``."""
    if get_origin(kind) not in {Union, types.UnionType}:
        return kind
    parts = [plain(part)[0] for part in get_args(kind) if part is not types.NoneType]
    return parts[0] if len(parts) == 1 else kind


def _unknown(root: type[Settings], place: _Place, key: str, value: Any) -> str:
    """Sentence on a key that is not known, with those that may have been meant."""
    table = place.name[: len(place.name) - len(key)]
    known = list(place.kind.model_fields)
    last = {name: name.rpartition(".")[2] for name in _names(root)}
    same = [name for name in last if last[name] == key]
    near = [table + name for name in get_close_matches(key, known, n=1, cutoff=_NEAR)]
    alike = get_close_matches(key, last.values(), n=1, cutoff=_ALIKE)
    meant = (same if len(same) <= _MOST else []) or near
    meant = meant or [name for name in last if last[name] in alike][:_MOST]
    more = f" and {len(known) - _LISTED} more" if len(known) > _LISTED else ""
    here = f"known here: {', '.join(known[:_LISTED])}{more}"
    hint = f"did you mean {' or '.join(meant)}?" if meant else here
    given = "" if isinstance(value, dict) else f" = {_shown(value)}"
    named = table + (key if key and key.isprintable() else repr(key))
    return f"unknown setting {named}{given}; {hint} ({_ALL})"


def _names(table: type[Settings], prefix: str = "") -> Iterator[str]:
    """Names of all settings of a table and of the tables in it, without the tables themselves."""
    for key, field in table.model_fields.items():
        inner = table_of(field.annotation)
        if inner is not None and is_table(field.annotation):
            yield from _names(inner, f"{prefix}{key}.")
        else:
            yield prefix + key


def _shown(value: Any) -> str:
    """The value as it was given, shortened."""
    plainly = isinstance(value, str | int | float | list | dict) and not isinstance(value, bool)
    text = repr(value) if plainly else str(value).lower()
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
