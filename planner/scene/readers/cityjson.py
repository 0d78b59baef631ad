"""CityJSON 1.x and 2.0, and CityJSONSeq: the best level of detail of every object."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.scene.readers.polygons import triangulate_faces, triangulate_rings
from planner.scene.readers.source import Source, refusal

_DEPTHS = {  # lists around a polygon (a list of rings)
    "MultiSurface": 1, "CompositeSurface": 1, "Solid": 2, "MultiSolid": 3, "CompositeSolid": 3,
}  # fmt: skip
Polygon = list[list[int]]


def read_cityjson(path: Path) -> Source:
    """Read a CityJSON file, or a sequence of features one a line.

    Raises
    ------
    PlannerError
        If it is not CityJSON or its geometry is damaged.

    """
    try:
        documents = _documents(path)
        return _assemble(path, documents)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, RecursionError) as error:
        wrong = f"it is no valid CityJSON ({type(error).__name__} {error})"
        raise refusal(path, wrong, "export it as CityJSON 1.1 or 2.0") from error


def _documents(path: Path) -> list[dict[str, Any]]:
    """The header document, with its objects, and the features that follow it."""
    text = path.read_text(encoding="utf-8-sig")
    if path.suffix.lower() == ".jsonl":
        documents = [json.loads(line) for line in text.splitlines() if line.strip()]
    else:
        documents = [json.loads(text)]
    kinds = [document["type"] for document in documents]
    if kinds[:1] != ["CityJSON"] or set(kinds[1:]) - {"CityJSONFeature"}:
        raise ValueError(f"type {kinds[0]!r} where CityJSON is expected")
    return documents


def _assemble(path: Path, documents: list[dict[str, Any]]) -> Source:
    """All surfaces of all documents in one mesh."""
    header = documents[0]
    transform = header.get("transform", {"scale": (1, 1, 1), "translate": (0, 0, 0)})
    scale, shift = (np.array(transform[key], dtype=np.float64) for key in ("scale", "translate"))
    soup = _Soup()
    for document in documents:
        own = _points(document.get("vertices", [])) * scale + shift
        geometries = list(_geometries(document.get("CityObjects", {})))
        soup.add(own, [polygon for geometry in geometries for polygon in _polygons(geometry)])
        for geometry in geometries:
            if geometry["type"] == "GeometryInstance":
                soup.add(*_instance(header, geometry, own))
    if not soup.polygons:
        raise refusal(path, "it has no surfaces", "export it with the geometry of its objects")
    xyz = np.concatenate(soup.vertices)
    return Source(xyz, _triangles(path, xyz, soup.polygons), crs=_crs(header))


class _Soup:
    """Vertices and polygons of many parts, numbered through."""

    def __init__(self) -> None:
        self.vertices: list[Floats] = []
        self.polygons: list[Polygon] = []
        self._count = 0

    def add(self, vertices: Floats, polygons: list[Polygon]) -> None:
        """Append polygons that name rows of their own vertices."""
        for polygon in polygons:
            for ring in polygon:
                if min(ring, default=0) < 0 or max(ring, default=0) >= max(1, len(vertices)):
                    raise ValueError(f"a surface names vertex {max(ring)} of {len(vertices)}")
            self.polygons.append([[row + self._count for row in ring] for ring in polygon])
        self.vertices.append(vertices)
        self._count += len(vertices)


def _points(values: Any) -> Floats:
    return np.array(values, dtype=np.float64).reshape(-1, 3)


def _geometries(objects: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Geometries of the highest level of detail of each object.

    A footprint (level 0) gives way to the volumes of the object's children.
    """
    best = {
        name: max((_lod(geometry) for geometry in thing.get("geometry", ())), default=-1.0)
        for name, thing in objects.items()
    }
    for name, thing in objects.items():
        below = max((best.get(child, -1.0) for child in thing.get("children", ())), default=-1.0)
        if best[name] < 1.0 <= below:
            continue
        for geometry in thing.get("geometry", ()):
            if _lod(geometry) == best[name]:
                yield geometry


def _lod(geometry: dict[str, Any]) -> float:
    return float(geometry.get("lod", 0.0))


def _polygons(geometry: dict[str, Any]) -> list[Polygon]:
    """Polygons of a geometry; none for points, lines and instances of templates."""
    depth = _DEPTHS.get(geometry["type"])
    if depth is None:
        return []
    level = geometry["boundaries"]
    for _ in range(depth - 1):
        level = [polygon for part in level for polygon in part]
    return [polygon for polygon in level if polygon and len(polygon[0]) >= 3]


def _instance(
    header: dict[str, Any], geometry: dict[str, Any], own: Floats
) -> tuple[Floats, list[Polygon]]:
    """Vertices and polygons of a template at the place that an object puts it."""
    store = header["geometry-templates"]
    matrix = np.array(geometry["transformationMatrix"], dtype=np.float64).reshape(4, 4)
    vertices = _points(store["vertices-templates"]) @ matrix[:3, :3].T + matrix[:3, 3]
    anchor = own[geometry["boundaries"][0]]
    return vertices + anchor, _polygons(store["templates"][geometry["template"]])


def _triangles(path: Path, xyz: Floats, polygons: list[Polygon]) -> Ints:
    """Triangles of all polygons: those without holes by length, the others one by one."""
    plain: dict[int, list[list[int]]] = {}
    parts: list[Ints] = []
    for polygon in polygons:
        if len(polygon) == 1:
            plain.setdefault(len(polygon[0]), []).append(polygon[0])
        else:
            parts.append(
                triangulate_rings(xyz, [np.array(ring, dtype=np.int64) for ring in polygon])
            )
    groups = [np.array(rings, dtype=np.int64) for _, rings in sorted(plain.items())]
    return np.concatenate([triangulate_faces(path, xyz, groups), *parts])


def _crs(header: dict[str, Any]) -> str | None:
    """``EPSG:n`` out of the URL or URN of the reference system."""
    name = str(header.get("metadata", {}).get("referenceSystem", ""))
    code = re.search(r"EPSG\D.*?(\d+)$", name, flags=re.IGNORECASE)
    return f"EPSG:{code.group(1)}" if code else None
