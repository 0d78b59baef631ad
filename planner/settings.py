"""What all settings have in common: strict, with units, and described where they are declared."""

import types
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict
from pydantic.fields import FieldInfo


class Settings(BaseModel):
    """One table of settings; the text below each of them is its description."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit of a setting, as it is told."""

    name: str


Metres = Annotated[float, Unit("m")]
MetresPerSecond = Annotated[float, Unit("m/s")]
MetresPerSecondSquared = Annotated[float, Unit("m/s²")]
MetresPerPixel = Annotated[float, Unit("m/px")]
Minutes = Annotated[float, Unit("min")]
Seconds = Annotated[float, Unit("s")]
Degrees = Annotated[float, Unit("degrees")]
DegreesPerSecond = Annotated[float, Unit("degrees/s")]
Percent = Annotated[float, Unit("%")]
Pixels = Annotated[float, Unit("px")]
WholePixels = Annotated[int, Unit("px")]

_WORDS = {float: "a number", int: "a whole number", str: "text", bool: "true or false"}
_LIMITS = ("gt", "ge", "le", "lt", "min_length", "max_length")


def takes(annotation: Any, limits: Sequence[Any] = ()) -> str:
    """What a setting takes in plain words, such as ``a number above 0 or "auto"``.

    Parameters
    ----------
    annotation
        Type of the setting, or of an item of a list.
    limits
        What else pydantic knows of it, such as the ``metadata`` of a field.

    """
    annotation, noted = plain(annotation)
    bounds = bounds_of([*limits, *noted])
    inner, origin = get_args(annotation), get_origin(annotation)
    if origin is Literal:
        return _either([f'"{choice}"' for choice in inner])
    if origin in {Union, types.UnionType}:
        parts = [takes(part, limits) for part in inner if part is not types.NoneType]
        return " or ".join(parts)
    if origin is tuple:
        return _listed(inner, bounds)
    words = "a table" if is_table(annotation) else _WORDS[annotation]
    return f"{words} {range_of(bounds)}".strip()


def bounds_of(limits: Sequence[Any]) -> dict[str, float]:
    """Limits of a number or a length by pydantic's names, such as ``{"gt": 0}``."""
    return {
        name: getattr(limit, name)
        for limit in limits
        for name in _LIMITS
        if getattr(limit, name, None) is not None
    }


def range_of(bounds: dict[str, float]) -> str:
    """Range of a number, or least length of a list or text; empty if any will do."""
    if "min_length" in bounds:
        return (
            "that is not empty" if bounds["min_length"] == 1 else f"{bounds['min_length']} or more"
        )
    words = {"gt": "above {}", "ge": "from {}", "le": "up to {}", "lt": "below {}"}
    said = [words[key].format(_number(bounds[key])) for key in words if key in bounds]
    if set(bounds) == {"ge", "le"}:
        return f"{said[0]} to {_number(bounds['le'])}"
    return ", ".join(said) + (" up" if set(bounds) == {"ge"} else "")


def unit_of(field: FieldInfo) -> str:
    """Unit of a setting; empty if it has none."""
    parts = [field.annotation, *get_args(field.annotation)]
    notes = [*field.metadata, *(note for part in parts for note in plain(part)[1])]
    return next((note.name for note in notes if isinstance(note, Unit)), "")


def plain(annotation: Any) -> tuple[Any, list[Any]]:
    """A type without what is noted on it, and these notes."""
    if get_origin(annotation) is not Annotated:
        return annotation, []
    inner, *notes = get_args(annotation)
    return inner, [
        part
        for note in notes
        for part in (note.metadata if isinstance(note, FieldInfo) else [note])
    ]


def is_table(annotation: Any) -> bool:
    """Whether a type is a table of settings."""
    return isinstance(annotation, type) and issubclass(annotation, Settings)


def table_of(annotation: Any) -> type[Settings] | None:
    """The table that a type is or that it is a list of, if it is one."""
    found = get_args(annotation)[0] if get_origin(annotation) is tuple else annotation
    return found if is_table(found) else None


def _listed(items: tuple[Any, ...], bounds: dict[str, float]) -> str:
    """Words for a list of any length, or for a few numbers."""
    item = plain(items[0])[0]
    if Ellipsis not in items:
        return f"{len(items)} numbers"
    if item is float:
        return f"{bounds['min_length']} or {bounds['max_length']} numbers"
    words = {str: "texts"}.get(item, "tables" if is_table(item) else f"{takes(items[0])} each")
    least = f", at least {bounds['min_length']} of them" if "min_length" in bounds else ""
    return f"a list of {words}{least}"


def _either(words: list[str]) -> str:
    return " or ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


def _number(value: float) -> str:
    """A limit as it is said: 4,000,000 rather than 4000000."""
    return f"{value:,}" if isinstance(value, int) else f"{value:,g}"
