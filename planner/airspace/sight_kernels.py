"""Compiled lines of sight through a grid of cells; import only where they are drawn."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]

OPAQUE = np.uint8(1)  # something solid touches the cell
DATA = np.uint8(2)  # raw points lie in the cell or beside it
SEEN = np.uint8(4)  # a line of sight passes the cell and ends at data


@compiled
def mark_seen(flags: Array, ways: Array) -> None:
    """Set SEEN in every clear cell that a line passes from the open sky down to data.

    Lines go through the centre of the cell. ``ways`` (W, 3) lead up, their largest component is
    one in size, so that each step changes one index by one: no step passes a surface whose cells
    are all opaque.
    """
    nx, ny, nz = flags.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if flags[i, j, k] & OPAQUE:
                    continue
                for w in range(len(ways)):
                    end = _end(flags, i, j, k, -ways[w])
                    if end & DATA and _end(flags, i, j, k, ways[w]) == 0:
                        flags[i, j, k] |= SEEN
                        break


@compiled
def _end(flags: Array, i: int, j: int, k: int, way: Array) -> int:
    """Flags of the first opaque cell on a way, 0 if it leads out of the grid."""
    nx, ny, nz = flags.shape
    step = 1
    while True:
        a = i + math.floor(step * way[0] + 0.5)
        b = j + math.floor(step * way[1] + 0.5)
        c = k + math.floor(step * way[2] + 0.5)
        if not (0 <= a < nx and 0 <= b < ny and 0 <= c < nz):
            return 0
        if flags[a, b, c] & OPAQUE:
            return int(flags[a, b, c])
        step += 1
