"""What every reader returns, and how every reader complains."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from planner.errors import PlannerError
from planner.geometry.arrays import Bytes, Floats, Ints

_LONGEST = 200


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """The content of a file as it stands there: no turning, scaling or cleaning yet.

    Parameters
    ----------
    xyz
        Points, or vertices of a mesh, shape (N, 3), source units and axes, float64.
    triangles
        Rows of ``xyz`` of each triangle, shape (T, 3), or ``None`` for a point cloud.
    normals, colours, classes
        As in :class:`planner.scene.cloud.PointCloud`, or ``None``; ignored for a mesh.
    crs
        ``EPSG:n`` or WKT, or ``None`` if the file has none.
    unit_metres
        Length of a source unit, where the format or the CRS says it.
    up
        The format's vertical axis.
    notes
        What the reader had to decide, one sentence each.

    """

    xyz: Floats
    triangles: Ints | None = None
    normals: Floats | None = None
    colours: Bytes | None = None
    classes: Bytes | None = None
    crs: str | None = None
    unit_metres: float | None = None
    up: Literal["y", "z"] = "z"
    notes: tuple[str, ...] = ()


def refusal(path: Path, wrong: str, remedy: str) -> PlannerError:
    """One-line error that names the file, what is wrong with it and the remedy."""
    told = "".join(letter if letter.isprintable() else "?" for letter in " ".join(wrong.split()))
    if len(told) > _LONGEST:  # foreign messages may quote half a file
        told = told[: _LONGEST - 3] + "..."
    return PlannerError(f"{path}: {told}; {remedy}")


def truncated(path: Path, what: str) -> PlannerError:
    """Error for a file that ends before what its header promises."""
    return refusal(
        path, f"the file is cut short or damaged ({what})", "copy or export it again and retry"
    )


def colour_bytes(colours: Floats) -> Bytes:
    """Colours as bytes, out of numbers up to 1, up to 255 or up to 65535, shape (N, 3)."""
    colours = np.nan_to_num(colours)
    top = colours.max(initial=0.0)
    scale = 255.0 if 0.0 < top <= 1.0 else 255.0 / 65535.0 if top > 255.0 else 1.0
    return np.asarray((colours * scale).clip(0, 255), dtype=np.uint8)
