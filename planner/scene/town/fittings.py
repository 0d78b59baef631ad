"""What hangs on walls and stands on roofs: balconies, parapets, machines."""

import numpy as np

from planner.scene.town.building import Building, Kind, Site
from planner.scene.town.solids import Footprint, box, ring

STOREY = 3.0  # metres


def balconies(
    built: Building,
    site: Site,
    walls: Footprint,
    roof: float,
    rng: np.random.Generator,
    *,
    share: float,
) -> None:
    """Hang rows of balconies on one long side or on both, within the parcel.

    Parameters
    ----------
    built
        Building that gets them.
    site
        Its site; the balconies end at the rim of its room.
    walls
        Footprint of the walls, first axis along the long side.
    roof
        Height below which they hang, metres.
    rng
        Source of chance.
    share
        Chance of each single balcony.

    """
    room = site.room.long_side_first()
    deep = min(room.v - walls.v, 1.6)
    columns, half = max(1, int((2.0 * walls.u - 1.0) // 4.0)), min(1.3, 0.9 * walls.u)
    floors = int((roof - site.ground - 1.3) // STOREY)
    if deep < 0.3 or floors < 1:
        return
    for side in (-1.0, 1.0) if rng.random() < 0.5 else (1.0,):
        there = rng.random((floors, columns)) < share
        there[0, 0] = True
        v = sorted((side * (walls.v - 0.1), side * (walls.v + deep)))
        for floor, column in np.argwhere(there):
            u = (column - 0.5 * (columns - 1)) * 4.0
            z = site.ground + STOREY * (floor + 1.0) - 0.2
            slab = walls.part((u - half, u + half), (v[0], v[1]))
            built.add(box(slab, z, z + 1.2), kind=Kind.BALCONY)


def parapet(built: Building, walls: Footprint, roof: float, height: float) -> None:
    """Put a low wall round a flat roof."""
    thick = min(0.35, 0.2 * min(walls.u, walls.v))
    built.add(ring(walls.corners(), walls.inset(thick).corners(), roof - 0.15, roof + height))


def machines(
    built: Building, walls: Footprint, roof: float, height: float, rng: np.random.Generator
) -> None:
    """Put up to four ventilation boxes on a roof."""
    if min(walls.u, walls.v) < 3.0:
        return
    for _ in range(int(rng.integers(0, 5))):
        u = float(rng.uniform(-0.75, 0.75)) * walls.u
        v = float(rng.uniform(-0.7, 0.7)) * walls.v
        w = float(rng.uniform(0.4, 0.8))
        built.add(box(walls.part((u - w, u + w), (v - w, v + w)), roof - 0.1, roof + height))
