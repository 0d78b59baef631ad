"""Zones from GeoJSON files and other coordinates, brought into the local frame."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from planner.config import AirspaceSettings, ZoneSettings
from planner.errors import PlannerError
from planner.geometry.arrays import Floats
from planner.geometry.frames import Frame
from planner.mistakes import first_mistake
from planner.scene.scene import Ground, Scene

GEOJSON_CRS = "OGC:CRS84"
"""Longitude and latitude on WGS84: what a GeoJSON file holds (RFC 7946)."""

_LARGEST = 64_000_000  # bytes of a file


def local_zones(settings: AirspaceSettings, scene: Scene) -> AirspaceSettings:
    """Bring all zones into the local frame, those of files included.

    Parameters
    ----------
    settings
        Zones in any coordinates, and names of files.
    scene
        Place whose frame counts, with the ground that heights may be above.

    Returns
    -------
    settings
        The same zones as prisms in local metres, and no files. Heights above ground become
        levels: a ``keep_out`` prism reaches from its lowest to its highest ground, a ``keep_in``
        prism the other way, so that neither allows more than it says.

    Raises
    ------
    PlannerError
        If a file cannot be read, holds what is no prism, or the scene's place in the world is
        not known.

    """
    settings = with_files(settings)
    placed = tuple(_placed(zone, scene, row) for row, zone in enumerate(settings.zones))
    return settings.model_copy(update={"zones": placed})


def with_files(settings: AirspaceSettings) -> AirspaceSettings:
    """Put the zones of files after the others, so that no file is left to read."""
    zones = (zone for name in settings.zone_files for zone in read_geojson(name))
    return settings.model_copy(update={"zones": (*settings.zones, *zones), "zone_files": ()})


def read_geojson(path: str | Path) -> list[ZoneSettings]:
    """Zones of a GeoJSON file: its polygons, with ``kind``, ``bottom``, ``top`` and ``name``.

    Parameters
    ----------
    path
        File with a feature collection, a feature or a geometry. Heights are above ground unless
        a feature's ``heights`` says otherwise; other properties are ignored.

    Returns
    -------
    zones
        One a polygon, in longitude and latitude.

    Raises
    ------
    PlannerError
        If the file cannot be read, or a polygon has a hole or cannot be a zone.

    """
    try:
        if Path(path).stat().st_size > _LARGEST:
            raise PlannerError(f"{path}: is larger than {_LARGEST / 1e6:.0f} MB; leave zones out")
        tree = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise PlannerError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    except (ValueError, RecursionError) as error:
        raise PlannerError(f"{path}: is not valid JSON ({error}); mend that line") from None
    if isinstance(tree, dict) and tree.get("crs") and "CRS84" not in json.dumps(tree["crs"]):
        raise PlannerError(
            f"{path}: names a crs other than CRS84, which GeoJSON has no more; export it in "
            "longitude and latitude (EPSG:4326, without the member crs)"
        )
    zones = [
        _zone(rings, properties, f"{path}: polygon {row}")
        for row, (rings, properties) in enumerate(_polygons(tree, {}, str(path)))
    ]
    if not zones:
        raise PlannerError(f"{path}: holds no polygon; draw the zones as polygons")
    return zones


def _polygons(tree: Any, properties: Any, path: str) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Rings and properties of every polygon of a GeoJSON object."""
    kind = tree.get("type") if isinstance(tree, dict) else None
    children = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
    try:
        if kind in children:
            for child in tree[children[kind]]:
                yield from _polygons(child, properties, path)
        elif kind == "Feature":
            yield from _polygons(tree["geometry"], tree.get("properties") or {}, path)
        elif kind == "MultiPolygon":
            for rings in tree["coordinates"]:
                yield rings, properties
        elif kind == "Polygon":
            yield tree["coordinates"], properties
        else:
            raise PlannerError(f"{path}: holds a {kind}, which is no zone; draw polygons")
    except (KeyError, TypeError, RecursionError) as error:
        raise PlannerError(f"{path}: is not GeoJSON ({error!r}); export it again") from None


def _zone(rings: Any, properties: dict[str, Any], where: str) -> ZoneSettings:
    try:
        if len(rings) != 1:
            raise PlannerError(f"{where} has a hole; cut it into polygons without")
        corners = [(float(corner[0]), float(corner[1])) for corner in rings[0]]
        named = ("kind", "bottom", "top", "name", "heights")
        given = {key: properties[key] for key in named if properties.get(key) is not None}
        values = {"heights": "ground", **given, "crs": GEOJSON_CRS}
        last = -1 if corners[0] == corners[-1] else len(corners)  # a ring ends where it starts
        return ZoneSettings(polygon=tuple(corners[:last]), **values)
    except ValidationError as error:
        raise PlannerError(f"{where}: {first_mistake(error, ZoneSettings)[1]}") from None
    except (TypeError, ValueError, IndexError, AttributeError) as error:
        raise PlannerError(f"{where} is malformed ({error}); export it again") from None


def _placed(zone: ZoneSettings, scene: Scene, row: int) -> ZoneSettings:
    """The zone in local metres."""
    where = f"zone {zone.name or row!r}"
    outline = _local_outline(zone, scene.frame, where)
    bottom, top = zone.bottom, zone.top
    if zone.heights == "source":
        shift = -float(scene.frame.origin[2])
        bottom, top = _raised(bottom, shift), _raised(top, shift)
    elif zone.heights == "ground":
        low, high = _ground_under(outline, scene.ground)
        if zone.kind == "keep_in":
            low, high = high, low
        bottom, top = _raised(bottom, low), _raised(top, high)
        if bottom is not None and top is not None and bottom >= top:
            raise PlannerError(
                f"{where}: the ground under it rises by {abs(high - low):.1f} m, so that nothing "
                f"lies {zone.bottom} to {zone.top} m above all of it; cut it into smaller ones"
            )
    corners = tuple((float(x), float(y)) for x, y in outline)
    return ZoneSettings(kind=zone.kind, polygon=corners, bottom=bottom, top=top, name=zone.name)


def _raised(height: float | None, shift: float) -> float | None:
    return None if height is None else height + shift


def _local_outline(zone: ZoneSettings, frame: Frame, where: str) -> Floats:
    """Corners of a zone in local metres, shape (K, 2)."""
    corners = np.array(zone.polygon, dtype=np.float64)
    if zone.crs == "local":
        return corners
    if zone.crs != "source":
        corners = _projected(corners, zone.crs, frame.crs, where)
    return np.asarray(corners * frame.unit_metres - frame.origin[:2])


def _projected(corners: Floats, crs: str, target: str | None, where: str) -> Floats:
    """Corners in another reference system; x is east or longitude in both."""
    from pyproj import CRS, Transformer
    from pyproj.exceptions import CRSError, ProjError

    if target is None:
        raise PlannerError(
            f"{where}: is given in {crs}, but the scene does not say where it is; "
            "set scene.crs, or give the zone in local metres"
        )
    try:
        to_local = Transformer.from_crs(CRS(crs), CRS(target), always_xy=True)
        x, y = to_local.transform(corners[:, 0], corners[:, 1], errcheck=True)
    except (CRSError, ProjError) as error:
        reason = str(error).splitlines()[0]
        raise PlannerError(f"{where}: cannot be brought to {target} ({reason}); mend it") from None
    return np.column_stack([x, y])


def _ground_under(outline: Floats, ground: Ground) -> tuple[float, float]:
    """Lowest and highest ground in the rectangle around an outline."""
    low = np.floor((outline.min(axis=0) - ground.origin) / ground.cell).astype(np.int64)
    high = np.floor((outline.max(axis=0) - ground.origin) / ground.cell).astype(np.int64)
    last = np.array(ground.heights.shape) - 1
    (i, j), (k, l) = low.clip(0, last), high.clip(0, last)
    under = ground.heights[i : k + 1, j : l + 1]
    return float(under.min()), float(under.max())
