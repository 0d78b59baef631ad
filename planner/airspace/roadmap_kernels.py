"""Compiled best-first search over cells that are looked at as they are met."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.geometry.compiled import compiled

Array = NDArray[Any]

WIDTH = 8  # cells along each side of a tile
FOUND, EXHAUSTED, UNKNOWN_TILE, FULL_HEAP, SPENT = 0, 1, 2, 3, 4
FREE, CLOSED = 1, 2  # flags of a cell: it may be entered; its way is final
_STEPS = np.array([0.0, 1.0, math.sqrt(2.0), math.sqrt(3.0)])


@compiled
def grid_distance(x: float, y: float, z: float) -> float:
    """Length of the shortest way over such differences by steps to the 26 neighbours."""
    x, y, z = abs(x), abs(y), abs(z)
    least, most = min(x, y, z), max(x, y, z)
    middle = x + y + z - least - most
    return float(_STEPS[3] * least + _STEPS[2] * (middle - least) + (most - middle))


@compiled
def push(keys: Array, cells: Array, count: int, key: float, cell: int) -> int:
    """Add a cell to the binary heap, whose order is that of keys and then of cells."""
    at = count
    while at > 0:
        above = (at - 1) // 2
        if keys[above] < key or (keys[above] == key and cells[above] <= cell):
            break
        keys[at], cells[at] = keys[above], cells[above]
        at = above
    keys[at], cells[at] = key, cell
    return count + 1


@compiled
def _pop(keys: Array, cells: Array, count: int) -> int:
    """Take the first cell off the heap."""
    count -= 1
    key, cell = keys[count], cells[count]
    at = 0
    while 2 * at + 1 < count:
        below = 2 * at + 1
        if below + 1 < count and (
            keys[below + 1] < keys[below]
            or (keys[below + 1] == keys[below] and cells[below + 1] < cells[below])
        ):
            below += 1
        if key < keys[below] or (key == keys[below] and cell <= cells[below]):
            break
        keys[at], cells[at] = keys[below], cells[below]
        at = below
    keys[at], cells[at] = key, cell
    return count


@compiled
def search(  # noqa: PLR0917 - compiled
    shape: Array,
    slots: Array,
    flags: Array,
    reach: Array,
    before: Array,
    stamps: Array,
    stamp: int,
    goal: Array,
    exits: Array,
    exit_costs: Array,
    keys: Array,
    cells: Array,
    state: Array,
    limit: int,
) -> int:
    """Go on with a search until it ends or wants something; return which.

    ``slots`` (tiles) holds the row of each tile in ``flags``, ``reach``, ``before`` and
    ``stamps`` (rows, 512), or -1 where it has not been looked at: then ``state[1]`` is the tile.
    Values of other searches carry another stamp. ``before`` numbers the step that led to a cell,
    from 0 to 26; 13 is none. ``goal`` are the coordinates of the goal in
    cells, ``exits`` the cells next to it, with the cost of the last edge. ``state`` holds the size
    of the heap, the wanted tile, the cells that are done, and at the end the last cell (or -1).
    """
    count, done = state[0], state[2]
    nx, ny, nz = shape[0], shape[1], shape[2]
    ty, tz = (ny + WIDTH - 1) // WIDTH, (nz + WIDTH - 1) // WIDTH
    while count > 0:
        cell = cells[0]
        if cell < 0:  # the goal itself, by the exit that was pushed
            state[0], state[2], state[3] = count, done, -cell - 1
            return FOUND
        if count + 28 > len(keys):
            state[0], state[2] = count, done
            return FULL_HEAP
        i, j, k = cell // (ny * nz), cell // nz % ny, cell % nz
        row = slots[(i // WIDTH * ty + j // WIDTH) * tz + k // WIDTH]
        at = (i % WIDTH * WIDTH + j % WIDTH) * WIDTH + k % WIDTH
        if flags[row, at] & CLOSED and stamps[row, at] == stamp:
            count = _pop(keys, cells, count)
            continue
        for a in range(max(i - 1, 0) // WIDTH, min(i + 1, nx - 1) // WIDTH + 1):
            for b in range(max(j - 1, 0) // WIDTH, min(j + 1, ny - 1) // WIDTH + 1):
                for c in range(max(k - 1, 0) // WIDTH, min(k + 1, nz - 1) // WIDTH + 1):
                    if slots[(a * ty + b) * tz + c] < 0:
                        state[0], state[1], state[2] = count, (a * ty + b) * tz + c, done
                        return UNKNOWN_TILE
        if done >= limit:
            state[0], state[2] = count, done
            return SPENT
        count = _pop(keys, cells, count)
        flags[row, at] |= CLOSED
        done += 1
        length = reach[row, at]
        for e in range(len(exits)):
            if exits[e] == cell:
                count = push(keys, cells, count, length + exit_costs[e], -cell - 1)
        for di in range(-1, 2):
            for dj in range(-1, 2):
                for dk in range(-1, 2):
                    x, y, z = i + di, j + dj, k + dk
                    if x < 0 or y < 0 or z < 0 or x >= nx or y >= ny or z >= nz:
                        continue
                    slot = slots[(x // WIDTH * ty + y // WIDTH) * tz + z // WIDTH]
                    place = (x % WIDTH * WIDTH + y % WIDTH) * WIDTH + z % WIDTH
                    if not flags[slot, place] & FREE:
                        continue
                    new = length + _STEPS[abs(di) + abs(dj) + abs(dk)]
                    if stamps[slot, place] == stamp:
                        if reach[slot, place] <= new + 1e-9:
                            continue
                    else:
                        stamps[slot, place] = stamp
                    flags[slot, place] = FREE
                    reach[slot, place] = new
                    before[slot, place] = (di + 1) * 9 + (dj + 1) * 3 + dk + 1
                    ahead = grid_distance(x - goal[0], y - goal[1], z - goal[2])
                    count = push(keys, cells, count, new + ahead, (x * ny + y) * nz + z)
    state[0], state[2], state[3] = 0, done, -1
    return EXHAUSTED
