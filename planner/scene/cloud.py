"""Point clouds and triangle meshes."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bools, Bytes, Floats, Ints, read_only


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud:
    """Points of a scene.

    Parameters
    ----------
    xyz
        Positions, shape (N, 3), metres, local frame, z up.
    normals
        Unit outward normals, shape (N, 3), or ``None`` if not estimated yet.
    colours
        Red, green, blue, shape (N, 3), 0 to 255, or ``None``.
    classes
        LAS classification codes, shape (N,), or ``None``.

    """

    xyz: Floats
    normals: Floats | None = None
    colours: Bytes | None = None
    classes: Bytes | None = None

    def __post_init__(self) -> None:
        count = len(self.xyz)
        object.__setattr__(self, "xyz", read_only(self.xyz, (None, 3), name="xyz"))
        for name, shape, dtype in (
            ("normals", (count, 3), np.float64),
            ("colours", (count, 3), np.uint8),
            ("classes", (count,), np.uint8),
        ):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, read_only(values, shape, name=name, dtype=dtype))

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, rows: Ints | Bools) -> "PointCloud":
        """Return the cloud of the chosen rows (indices or a mask), in that order."""
        normals, colours, classes = self.normals, self.colours, self.classes
        return PointCloud(
            self.xyz[rows],
            None if normals is None else normals[rows],
            None if colours is None else colours[rows],
            None if classes is None else classes[rows],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles; may be open, non-manifold and of mixed orientation.

    Parameters
    ----------
    vertices
        Shape (N, 3), metres, local frame, z up.
    triangles
        Vertex rows of each triangle, shape (T, 3).

    """

    vertices: Floats
    triangles: Ints

    def __post_init__(self) -> None:
        vertices = read_only(self.vertices, (None, 3), name="vertices")
        triangles = read_only(self.triangles, (None, 3), name="triangles", dtype=np.int64)
        if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(vertices):
            raise ValueError(f"triangles name vertices outside 0..{len(vertices) - 1}.")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)

    def __len__(self) -> int:
        return len(self.triangles)
