"""An airspace as plain arrays, for a file that needs no pickle, and back with every check."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.airspace.zones import Prism, Zones, ceiling_over
from planner.errors import PlannerError
from planner.geometry.arrays import Floats, Ints
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground

_MOST = 50_000_000  # rows of any array
_FARTHEST = 1e7  # metres from the local origin
_NUMBERS = ("ground_cell", "ceiling", "zone_margin", "d_min", "d_max")
_SHAPES: dict[str, tuple[int | None, ...]] = {
    "vertices": (None, 3),
    "triangles": (None, 3),
    "parts": (3,),
    "obstacles": (None, 3),
    "ground_heights": (None, None),
    "ground_origin": (2,),
    "low": (3,),
    "high": (3,),
    "grid": (2,),
    **dict.fromkeys(_NUMBERS, ()),
}
_WHOLE = ("triangles", "parts", "grid")


@dataclass(frozen=True, slots=True, eq=False)
class StoredAirspace:
    """What a file says about an airspace, checked.

    Parameters
    ----------
    mesh
        All triangles of the solids, local metres.
    parts
        Number of triangles of surface, terrain and curtains, shape (3,).
    obstacles
        Raw points, shape (P, 3), metres.
    ground
        Terrain heights by cell.
    zones
        Prisms, ceiling, and what is kept from them.
    d_min, d_max
        Least clearance, and the farthest that a photo is taken from, metres.
    low, high
        Corners of the space in which flight is considered, shape (3,), metres.
    under_roofs
        Whether space under surfaces that face up was filled.
    most_cells
        Limit of the occupancy grid.

    """

    mesh: Mesh
    parts: Ints
    obstacles: Floats
    ground: Ground
    zones: Zones
    d_min: float
    d_max: float
    low: Floats
    high: Floats
    under_roofs: bool
    most_cells: int


def write_arrays(stored: StoredAirspace) -> dict[str, NDArray[Any]]:
    """Arrays for :func:`numpy.savez`; none holds objects.

    Parameters
    ----------
    stored
        The airspace.

    Returns
    -------
    arrays
        By name. ``zones`` is JSON text, ``ceiling`` is infinite where there is none.

    """
    ceiling = stored.zones.ceiling
    return {
        "vertices": stored.mesh.vertices,
        "triangles": stored.mesh.triangles,
        "parts": stored.parts,
        "obstacles": stored.obstacles,
        "ground_heights": stored.ground.heights,
        "ground_origin": stored.ground.origin,
        "ground_cell": np.array(stored.ground.cell),
        "zones": np.array(json.dumps([_prism_record(prism) for prism in stored.zones.prisms])),
        "ceiling": np.array(math.inf if ceiling is None else ceiling.above_ground),
        "zone_margin": np.array(stored.zones.kept),
        "d_min": np.array(stored.d_min),
        "d_max": np.array(stored.d_max),
        "low": stored.low,
        "high": stored.high,
        "grid": np.array([int(stored.under_roofs), stored.most_cells]),
    }


def read_arrays(
    arrays: Mapping[str, NDArray[Any]], *, name: str = "airspace.npz"
) -> StoredAirspace:
    """Check arrays that come from a file and turn them into an airspace's parts.

    Parameters
    ----------
    arrays
        As :func:`write_arrays` makes them; an open ``npz`` file (without pickles) is one.
    name
        What the file is called in complaints.

    Returns
    -------
    stored
        Everything finite, of the right shape and in range.

    Raises
    ------
    PlannerError
        If anything is missing or cannot be.

    """
    values = {key: _array(arrays, key, name) for key in _SHAPES}
    try:
        d_min, d_max = float(values["d_min"]), float(values["d_max"])
        _need(0.0 < d_min < d_max < _FARTHEST, name, f"d_min {d_min} and d_max {d_max}")
        _need((values["low"] < values["high"]).all(), name, "the bounds of the flight space")
        mesh = Mesh(values["vertices"], values["triangles"])
        parts = values["parts"].astype(np.int64)
        _need(parts.min() >= 0 and parts.sum() == len(mesh) > 0, name, f"parts {parts.tolist()}")
        cell = float(values["ground_cell"])
        _need(values["ground_heights"].size > 0 and 0.0 < cell < _FARTHEST, name, "the ground")
        ground = Ground(values["ground_heights"], values["ground_origin"], cell)
        roofs, most_cells = (int(n) for n in values["grid"])
        _need(roofs in {0, 1} and 1_000 <= most_cells <= 2_000_000_000, name, "the grid's limits")
        return StoredAirspace(
            mesh=mesh,
            parts=parts,
            obstacles=values["obstacles"],
            ground=ground,
            zones=_zones(
                arrays, float(values["ceiling"]), float(values["zone_margin"]), ground, name
            ),
            d_min=d_min,
            d_max=d_max,
            low=values["low"],
            high=values["high"],
            under_roofs=bool(roofs),
            most_cells=most_cells,
        )
    except (ValueError, TypeError, OverflowError) as error:
        raise PlannerError(_complaint(name, str(error))) from error


def _array(arrays: Mapping[str, NDArray[Any]], key: str, name: str) -> NDArray[Any]:
    """One numeric array, checked for shape, size and finite values."""
    try:
        array = np.asarray(arrays[key])
    except KeyError:
        raise PlannerError(_complaint(name, f"{key} is missing")) from None
    except (ValueError, OSError, EOFError) as error:  # objects, or a damaged archive
        raise PlannerError(_complaint(name, f"{key} cannot be read ({error})")) from error
    shape, kind = _SHAPES[key], "iu" if key in _WHOLE else "f"
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    _need(fits and array.size <= 3 * _MOST, name, f"{key} has shape {array.shape}")
    _need(array.dtype.kind in kind, name, f"{key} holds {array.dtype}")
    if kind == "f":
        near = (np.abs(array) <= _FARTHEST) | (np.isposinf(array) if key == "ceiling" else False)
        _need(near.all(), name, f"{key} holds values that are not finite or absurdly large")
        return array.astype(np.float64, copy=False)
    return array


def _prism_record(prism: Prism) -> dict[str, Any]:
    """One prism as plain values; an open end is null."""
    return {
        "kind": prism.kind,
        "polygon": prism.polygon.tolist(),
        "bottom": prism.bottom if math.isfinite(prism.bottom) else None,
        "top": prism.top if math.isfinite(prism.top) else None,
        "name": prism.name,
    }


def _zones(
    arrays: Mapping[str, NDArray[Any]], ceiling: float, kept: float, ground: Ground, name: str
) -> Zones:
    """Prisms from their JSON text, the ceiling, and what is kept from them."""
    _need(kept >= 0.0, name, f"zone_margin {kept}")
    if "zones" not in arrays:
        raise PlannerError(_complaint(name, "zones is missing"))
    try:
        records = json.loads(str(arrays["zones"][()]))
        if not isinstance(records, list):
            raise TypeError(f"a list is wanted, not {type(records).__name__}")
        prisms = tuple(
            Prism(
                {"keep_out": "keep_out", "keep_in": "keep_in"}[record["kind"]],  # type: ignore[arg-type]
                np.array(record["polygon"], dtype=np.float64).reshape(-1, 2),
                -math.inf if record["bottom"] is None else float(record["bottom"]),
                math.inf if record["top"] is None else float(record["top"]),
                str(record["name"]),
            )
            for record in records
        )
    except (KeyError, TypeError, ValueError) as error:
        raise PlannerError(_complaint(name, f"zones cannot be read ({error})")) from error
    if math.isinf(ceiling):
        return Zones(prisms, kept=kept)
    _need(ceiling > 0.0, name, f"ceiling {ceiling}")
    return Zones(prisms, ceiling_over(ground, ceiling), kept)


def _need(holds: object, name: str, what: str) -> None:
    if not holds:
        raise PlannerError(_complaint(name, f"{what} cannot be"))


def _complaint(name: str, what: str) -> str:
    return f"{name}: {' '.join(what.split())}; make the plan again"
