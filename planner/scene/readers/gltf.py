"""glTF 2.0: binary (.glb) and text (.gltf); meshes and points under all scene nodes."""

import base64
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planner.geometry.arrays import Floats, Ints
from planner.scene.readers.source import Source, refusal, truncated

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6
_DEEPEST = 64  # nodes under nodes
_UNPACKED = {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}


def read_gltf(path: Path) -> Source:
    """Read a glTF file, y up, metres, with the transforms of its nodes applied.

    Raises
    ------
    PlannerError
        If the file is damaged or packed in a way that is not read here.

    """
    try:
        model = _open(path)
        packed = _UNPACKED & set(model.tree.get("extensionsRequired", ()))
        if packed:
            wrong = f"its mesh is packed ({sorted(packed)[0]})"
            raise refusal(path, wrong, "export it without compression")
        return _assemble(model)
    except (KeyError, IndexError, TypeError, ValueError, RecursionError) as error:
        wrong = f"it is no valid glTF ({type(error).__name__} {error})"
        raise refusal(path, wrong, "export it again") from error


@dataclass(frozen=True, slots=True)
class _Model:
    path: Path
    tree: dict[str, Any]
    blob: bytes

    def accessor(self, index: int) -> np.ndarray:
        """Values of an accessor, shape (count, width)."""
        spec = self.tree["accessors"][index]
        dtype, width = np.dtype(_COMPONENTS[spec["componentType"]]), _WIDTHS[spec["type"]]
        if "sparse" in spec or "bufferView" not in spec:
            raise ValueError("sparse accessors are not read")
        view = self.tree["bufferViews"][spec["bufferView"]]
        data = self._buffer(view["buffer"])
        start = view.get("byteOffset", 0) + spec.get("byteOffset", 0)
        stride = view.get("byteStride", dtype.itemsize * width)
        end = start + stride * (spec["count"] - 1) + dtype.itemsize * width
        if start < 0 or spec["count"] < 1 or stride < dtype.itemsize * width or end > len(data):
            raise truncated(self.path, f"accessor {index} ends at byte {end} of {len(data)}")
        values = np.ndarray(
            (spec["count"], width), dtype, data, start, strides=(stride, dtype.itemsize)
        )
        if spec.get("normalized") and dtype.kind in "iu":
            return np.asarray(np.maximum(values / np.iinfo(dtype).max, -1.0))
        return values

    def _buffer(self, index: int) -> bytes:
        uri: str | None = self.tree["buffers"][index].get("uri")
        if uri is None:
            return self.blob
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        beside = (self.path.parent / uri).resolve()
        if not beside.is_relative_to(self.path.parent.resolve()) or not beside.is_file():
            raise refusal(self.path, f"its part {uri[:60]!r} is not beside it", "put it there")
        return beside.read_bytes()


def _open(path: Path) -> _Model:
    data = path.read_bytes()
    if path.suffix.lower() == ".gltf":
        return _Model(path, _tree(data), b"")
    if len(data) < 20:
        raise truncated(path, f"{len(data)} bytes")
    _, version, length, size, _ = np.frombuffer(data, "<u4", 5).tolist()
    if version != 2:
        raise refusal(path, f"it is glTF version {version}", "export it as glTF 2.0")
    if length > len(data) or 20 + size > len(data):
        raise truncated(path, f"{len(data)} of {length} bytes")
    return _Model(path, _tree(data[20 : 20 + size]), data[28 + size :])


def _tree(text: bytes) -> dict[str, Any]:
    tree = json.loads(text)
    if not isinstance(tree, dict):
        raise ValueError("no JSON object")
    return tree


def _assemble(model: _Model) -> Source:
    """All primitives of the default scene in one array."""
    tree = model.tree
    scenes = tree.get("scenes")
    roots = scenes[tree.get("scene", 0)].get("nodes", []) if scenes else range(len(tree["nodes"]))
    vertices: list[Floats] = []
    triangles: list[Ints] = []
    count = 0
    for mesh, world in _placed(tree, [(root, np.eye(4), 0) for root in roots]):
        for part in tree["meshes"][mesh]["primitives"]:
            corners = model.accessor(part["attributes"]["POSITION"]).astype(np.float64)
            vertices.append(corners @ world[:3, :3].T + world[:3, 3])
            triangles.append(_faces(model, part, len(corners)) + count)
            count += len(corners)
    if not vertices:
        raise ValueError("no mesh in its scene")
    faces = np.concatenate(triangles)
    if len(faces) and faces.max() >= count:
        raise truncated(model.path, "an index beyond the vertices")
    only_points = len(faces) == 0
    return Source(np.concatenate(vertices), None if only_points else faces, unit_metres=1.0, up="y")


def _placed(
    tree: dict[str, Any], waiting: list[tuple[int, Floats, int]]
) -> list[tuple[int, Floats]]:
    """Meshes with the transform that their node and those above give, shape (4, 4)."""
    found: list[tuple[int, Floats]] = []
    while waiting:
        index, above, depth = waiting.pop()
        if depth > _DEEPEST or len(found) > 100_000:
            raise ValueError("its nodes nest without end")
        node = tree["nodes"][index]
        world = above @ _transform(node)
        if "mesh" in node:
            found.append((node["mesh"], world))
        waiting += [(child, world, depth + 1) for child in node.get("children", ())]
    return found


def _transform(node: dict[str, Any]) -> Floats:
    """Parent-from-node matrix, shape (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _faces(model: _Model, part: dict[str, Any], count: int) -> Ints:
    """Triangles of a primitive, shape (T, 3); none for points and lines."""
    rows = np.arange(count)
    if "indices" in part:
        rows = model.accessor(part["indices"])[:, 0].astype(np.int64)
    mode = part.get("mode", _TRIANGLES)
    if mode == _TRIANGLES:
        return rows[: len(rows) // 3 * 3].reshape(-1, 3)
    if mode == _STRIP:
        strip = np.column_stack([rows[:-2], rows[1:-1], rows[2:]])
        strip[1::2] = strip[1::2, ::-1]
        return strip
    if mode == _FAN:
        return np.column_stack([np.full(max(0, len(rows) - 2), rows[0]), rows[1:-1], rows[2:]])
    return np.empty((0, 3), dtype=np.int64)
