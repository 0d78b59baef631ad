"""What the overview shows of the airspace: level lines of the no-fly hull, zones, close places."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.airspace.airspace import Airspace
from planner.airspace.zones import Prism
from planner.flight.path import FlightPath
from planner.geometry import bezier
from planner.geometry.arrays import Floats, read_only
from planner.scene.scene import Box

_LEVELS = 6
_NODES = 12_000  # of the lattice on each level
_PROBES = 65  # along each piece


@dataclass(frozen=True, slots=True, eq=False)
class HullDrawing:
    """Lines and places, local metres.

    Parameters
    ----------
    levels
        Heights of the level lines, rising.
    lines
        Level lines of the hull, by height: arrays of shape (n, 3).
    keep_out, keep_in
        Outlines of zones, each shape (n, 3), closed; open ends end at the known space.
    closest
        Place of the smallest clearance on the flight, shape (3,), or ``None`` without a flight.
    clearance
        Clearance there, metres.
    lost
        Places of photos that no safe flight reaches, shape (k, 3).

    """

    levels: tuple[float, ...]
    lines: tuple[tuple[Floats, ...], ...]
    keep_out: tuple[Floats, ...]
    keep_in: tuple[Floats, ...]
    closest: Floats | None
    clearance: float
    lost: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "lost", read_only(self.lost, (None, 3), name="lost"))


def hull_drawing(
    airspace: Airspace, box: Box, paths: Sequence[FlightPath], lost: Floats
) -> HullDrawing:
    """Work out what is to be drawn.

    Parameters
    ----------
    airspace
        Solids and zones.
    box
        Of the scene: level lines end ``d_min`` beyond its sides, where terrain is only continued.
    paths
        What is flown.
    lost
        Places of photos that they do not reach, shape (k, 3), metres.

    """
    levels = _heights(airspace)
    closest, clearance = _closest(airspace, [path for path in paths if len(path)])
    outlines: dict[str, list[Floats]] = {"keep_out": [], "keep_in": []}
    floor, roof = float(airspace.ground.heights.min()), float(airspace.high[2])
    for prism in airspace.zones.prisms:
        outlines[prism.kind] += _outlines(prism, floor, roof)
    return HullDrawing(
        tuple(levels),
        tuple(_lines_at(airspace, box, height) for height in levels),
        tuple(outlines["keep_out"]),
        tuple(outlines["keep_in"]),
        closest,
        clearance,
        lost,
    )


def _heights(airspace: Airspace) -> list[float]:
    """Heights from where most of the ground's own hull ends to over the highest raw point."""
    high = float(airspace.high[2])
    tops = airspace.obstacles[:, 2] if len(airspace.obstacles) else airspace.ground.heights
    first = float(np.percentile(airspace.ground.heights, 75.0)) + 1.1 * airspace.d_min
    last = min(float(np.percentile(tops, 99.9)) + 0.5 * airspace.d_min, high)
    return np.linspace(first, last, _LEVELS).tolist() if last > first else [first]


def _lines_at(airspace: Airspace, box: Box, height: float) -> tuple[Floats, ...]:
    """Where the clearance is ``d_min`` at one height over the box, as lines of shape (n, 3)."""
    from contourpy import contour_generator

    half = 0.5 * box.size[:2] + airspace.d_min
    step = float(np.sqrt(np.prod(2.0 * half) / _NODES))
    x, y = (np.linspace(-reach, reach, 2 + int(2.0 * reach / step)) for reach in half)
    at = np.stack(np.meshgrid(x, y, indexing="xy"), axis=-1).reshape(-1, 2)
    field = airspace.clearance_range(_placed(at, box, height))[0].reshape(len(y), len(x))
    lines = contour_generator(x, y, field).lines(airspace.d_min)
    return tuple(_placed(np.asarray(line, dtype=np.float64), box, height) for line in lines)


def _placed(level: Floats, box: Box, height: float) -> Floats:
    """Points given along the level axes of a box from its centre, shape (n, 2), at a height."""
    xy = box.centre[:2] + level @ box.axes[:2, :2]
    return np.column_stack([xy, np.full(len(xy), height)])


def _outlines(prism: Prism, floor: float, roof: float) -> list[Floats]:
    """Bottom, top and upright edges of a prism, cut at the lowest ground and the known roof."""
    ring = np.vstack([prism.polygon, prism.polygon[:1]])
    bottom, top = max(prism.bottom, floor), min(prism.top, roof)
    level = [np.column_stack([ring, np.full(len(ring), z)]) for z in (bottom, top)]
    return [*level, *(np.array([[*corner, bottom], [*corner, top]]) for corner in prism.polygon)]


def _closest(airspace: Airspace, paths: Sequence[FlightPath]) -> tuple[Floats | None, float]:
    """Nearest of many places along all paths, and the clearance there."""
    if not paths:
        return None, np.inf
    controls = np.concatenate([path.controls for path in paths])
    at = np.broadcast_to(np.linspace(0.0, 1.0, _PROBES), (len(controls), _PROBES))
    probes = bezier.evaluate(controls[:, None], at).reshape(-1, 3)
    row = int(np.argmin(airspace.clearance_range(probes)[0]))
    return probes[row], float(airspace.clearance(probes[[row]])[0])
