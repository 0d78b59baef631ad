"""From a file's axes, unit and large coordinates to the local frame."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner.config import SceneSettings
from planner.geometry.arrays import Bools, Floats
from planner.geometry.frames import Frame
from planner.scene.readers.source import Source, refusal

_UP = {
    "x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
_FAR = 10.0  # lengths of the scene from zero beyond which an origin is subtracted
_LARGEST = 5_000.0  # metres: a longer scene of unknown unit is not believed to be in metres
_SMALLEST = 20.0  # metres: a shorter one is not believed either, and planned by its own scale
_FLAT = 0.4  # of the other extents: a scene so flat along a level axis may lie on its side
_BAD_SHARE = 0.01
_ABSURD = 1e12  # no coordinate on Earth is so large, in any unit; NaN fails the test too


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A source in the local frame.

    Parameters
    ----------
    source
        The content with local positions, metres, z up.
    frame
        ``local = unit_metres * local_from_source @ source - origin``, where the CRS does not give
        heights a unit of their own.
    metric
        Whether the unit is known, or at least plausible.
    notes
        What was decided, one sentence each.

    """

    source: Source
    frame: Frame
    metric: bool
    notes: tuple[str, ...]


def place(path: Path, source: Source, settings: SceneSettings) -> Placed:
    """Turn, scale and shift a source into the local frame.

    Parameters
    ----------
    path
        For messages.
    source
        What a reader returned.
    settings
        ``up``, ``unit`` and ``crs`` overrule what the file says.

    Returns
    -------
    placed
        Local positions are exact to float64 rounding of the shift; the origin is whole metres.

    Raises
    ------
    PlannerError
        If too many coordinates are not finite, the unit is implausible, or the CRS is unusable.

    """
    source, notes = _finite(path, source)
    crs = _chosen_crs(path, source, settings, notes)
    up = source.up if settings.up == "auto" else settings.up
    xyz, normals = source.xyz, source.normals
    if up != "z":
        xyz = xyz @ _UP[up].T
        normals = None if normals is None else normals @ _UP[up].T
        notes.append(f"Turned from {up} up to z up.")
    stated = crs.unit or source.unit_metres if settings.unit == "auto" else settings.unit
    unit = 1.0 if stated is None else stated
    upward = crs.height_unit or unit if settings.unit == "auto" else unit
    if (unit, upward) != (1.0, 1.0):
        xyz = xyz * (unit, unit, upward)
        notes.append(f"Scaled to metres by {unit:.7g}, heights by {upward:.7g}.")
    span = np.ptp(xyz, axis=0)
    longest = float(span.max())
    if settings.up == "auto" and source.up == "z":
        notes += _doubt_about_up(span)
    metric = stated is not None or _plausible(path, span, notes)
    origin = _origin(xyz, longest)
    if origin.any():
        xyz = xyz - origin
    frame = Frame(origin, crs.name, crs.datum, unit, _UP.get(up), upward)
    return Placed(replace(source, xyz=xyz, normals=normals), frame, metric, tuple(notes))


def _doubt_about_up(span: Floats) -> list[str]:
    """A note if a scene of extent ``span`` is flattest along a level axis, as if on its side."""
    flattest = int(np.argmin(span))
    if flattest == 2 or span[flattest] > _FLAT * np.delete(span, flattest).min():
        return []
    axis = "xy"[flattest]
    return [f"The scene is flattest along {axis}: if that is its vertical, set scene.up to {axis}."]


def _finite(path: Path, source: Source) -> tuple[Source, list[str]]:
    """Drop the few rows (with their faces) that are not numbers; refuse many."""
    notes = list(source.notes)
    good: Bools = np.asarray((np.abs(source.xyz) < _ABSURD).all(axis=1))
    bad = int((~good).sum())
    if bad == 0:
        return source, notes
    if bad > _BAD_SHARE * len(good):
        wrong = f"{bad} of {len(good)} points have coordinates that are NaN, infinite or absurd"
        raise refusal(path, wrong, "remove these points or export the scan again")
    notes.append(f"Dropped {bad} of {len(good)} points whose coordinates are not finite.")
    triangles = source.triangles
    if triangles is not None:
        row = np.cumsum(good) - 1
        triangles = row[triangles[good[triangles].all(axis=1)]]
    kept = replace(
        source,
        xyz=source.xyz[good],
        triangles=triangles,
        normals=None if source.normals is None else source.normals[good],
        colours=None if source.colours is None else source.colours[good],
        classes=None if source.classes is None else source.classes[good],
    )
    return kept, notes


@dataclass(frozen=True, slots=True)
class _Reference:
    name: str | None = None
    datum: str | None = None
    unit: float | None = None
    height_unit: float | None = None


def _chosen_crs(
    path: Path, source: Source, settings: SceneSettings, notes: list[str]
) -> _Reference:
    """The CRS of the settings, else of the file, else none.

    Raises
    ------
    PlannerError
        If the one in the settings is not known, or the chosen one counts in degrees.

    """
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    text = settings.crs or source.crs
    if text is None:
        return _Reference()
    try:
        crs = CRS.from_user_input(text)
    except CRSError as error:
        wrong = f"the coordinate system {text[:60]!r} is not known"
        if settings.crs is not None:
            remedy = "set scene.crs to an EPSG code such as EPSG:25832"
            raise refusal(path, wrong, remedy) from error
        notes.append(f"{wrong[0].upper()}{wrong[1:]}: left out (set scene.crs to give it).")
        return _Reference()
    if crs.is_geographic or crs.is_geocentric:
        wrong = f"its coordinates are in {crs.name}, not in a map projection"
        raise refusal(path, wrong, "project it to metres (for example UTM) first")
    code = crs.to_epsg()
    vertical = [part for part in crs.sub_crs_list if part.is_vertical]
    return _Reference(
        name=text if code is None else f"EPSG:{code}",
        datum=vertical[0].name if vertical else None,
        unit=_axis_unit(crs),
        height_unit=_axis_unit(vertical[0]) if vertical else None,
    )


def _axis_unit(crs: Any) -> float | None:
    """Metres per unit of the first axis of a CRS, if it says so."""
    factor = crs.axis_info[0].unit_conversion_factor if crs.axis_info else 0.0
    return float(factor) or None


def _plausible(path: Path, span: Floats, notes: list[str]) -> bool:
    """Whether metres are a fair guess for a file without a unit, by its extent, shape (3,).

    Raises
    ------
    PlannerError
        If the scene would be kilometres long, or has the proportions of degrees.

    """
    longest = float(span.max())
    if span[:2].max() < 1.0 and span[2] > 200.0 * span[:2].max() > 0.0:
        wrong = f"it is {span[2]:.3g} high but only {span[:2].max():.2g} wide, as degrees are"
        raise refusal(path, wrong, "project it to metres (for example UTM) first")
    if longest > _LARGEST:
        wrong = f"its unit is not stated, and in metres it would be {longest / 1000:.1f} km long"
        remedy = "set scene.unit to the metres per unit (0.001 for millimetres, 1 for metres)"
        raise refusal(path, wrong, remedy)
    if longest < _SMALLEST:
        notes.append(
            f"The unit is not stated and the scene is {longest:.3g} units long: all lengths scale"
            " with the scene and read as its units (set scene.unit if it is not the metre)."
        )
        return False
    notes.append(
        f"The unit is not stated: taken as metres, since the scene is then {longest:.0f} m long."
    )
    return True


def _origin(xyz: Floats, longest: float) -> Floats:
    """Whole-metre corner of a scene far from zero, else zero, for x and y together and z alone."""
    low = np.floor(xyz.min(axis=0))
    far = np.abs(xyz).max(axis=0) > _FAR * max(longest, 1e-9)
    far[:2] = far[:2].any()
    return np.where(far, low, 0.0)
