"""Ways through free space on a grid of cells that is looked at only where ways lead."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from planner.geometry.arrays import Bytes, Floats, Ints

CELLS_A_D_MIN = 4.0
"""Cells in ``d_min``: finer ones change the length of ways by less than a hundredth."""

MOST_CELLS = 20_000_000
"""Cells that may be looked at, 14 bytes each."""

_MOST_TILES = 20_000_000  # whether looked at or not, 4 bytes each
_FIRST_LIMIT = 20_000  # cells of the first search; then from the other end, then four times as many
_NO_STEP = 13
_STRETCH = float(np.sqrt(3.0))  # longest step, in cells


@dataclass(frozen=True, slots=True, eq=False)
class GridWay:
    """Outcome of a search.

    Parameters
    ----------
    points
        Centres of cells from the first place to the last, shape (n, 3), metres, without the two
        places themselves; ``None`` if there is no way or none was found.
    apart
        Whether the two places are proven to lie in separate parts of the grid.

    """

    points: Floats | None
    apart: bool


class Roadmap:
    """Centres of free cells, joined to their 26 neighbours.

    A cell is free if its centre is so far from solids and zones that every edge to a free
    neighbour keeps the wanted distance: what is at least ``c`` away from both ends of an edge of
    length ``e`` is ``sqrt(c**2 - e**2 / 4)`` away from all of it, and a margin that changes by
    at most a metre a metre falls by no more than ``e / 2``.

    Parameters
    ----------
    clearance
        Lowest and highest value that the clearance of points, (m, 3), may have, each (m,), metres.
    zone_margin
        Signed distance of points to zones, (m,), metres.
    bounds
        Lowest and highest corner of the space, each (3,), metres.
    required, margin
        Distance to keep to solids, and to zones, metres.
    cell
        Cell width, metres; wider if the space would have too many.

    """

    def __init__(
        self,
        clearance: Callable[[Floats], tuple[Floats, Floats]],
        zone_margin: Callable[[Floats], Floats],
        bounds: tuple[Floats, Floats],
        *,
        required: float,
        margin: float,
        cell: float,
    ) -> None:
        from planner.airspace.roadmap_kernels import WIDTH

        while np.prod((bounds[1] - bounds[0]) / (WIDTH * cell) + 1.0) > _MOST_TILES:
            cell *= 1.1
        self._clearance, self._zone_margin = clearance, zone_margin
        edge = _STRETCH * cell
        self._least = float(np.hypot(required, 0.5 * edge))
        self._least_zone = margin + 0.5 * edge
        self._low, self.cell = bounds[0], cell
        self._shape = np.maximum(np.floor((bounds[1] - bounds[0]) / cell), 1.0).astype(np.int64)
        self._tiles = -(-self._shape // WIDTH)
        self._width = WIDTH
        self._slots = np.full(int(self._tiles.prod()), -1, dtype=np.int32)
        self._used, self._stamp, self._pockets = 0, 0, 0
        none = (0, WIDTH**3)
        self._flags: Bytes = np.zeros(none, dtype=np.uint8)
        self._reach = np.zeros(none, dtype=np.float32)
        self._before = np.zeros(none, dtype=np.int8)
        self._stamps = np.zeros(none, dtype=np.int32)
        self._pocket = np.zeros(none, dtype=np.int16)

    def centres(self, index: Ints) -> Floats:
        """Centres of cells, shape (n, 3), metres, from their index triples."""
        return np.asarray(self._low + (index + 0.5) * self.cell)

    def cells_near(self, point: Floats, radius: int) -> Ints:
        """Index triples of free cells within so many cells of a point, nearest first."""
        middle = np.floor((point - self._low) / self.cell).astype(np.int64)
        index = middle + _block(2 * radius + 1) - radius
        index = index[((index >= 0) & (index < self._shape)).all(axis=1)]
        for tile in np.unique(self._tile_of(index)).tolist():
            if self._slots[tile] < 0:
                self._look(tile)
        row, at = self._places(index)
        index = index[(self._flags[row, at] & 1) == 1]
        away = np.linalg.norm(self.centres(index) - point, axis=1)
        return np.asarray(index[np.argsort(away, kind="stable")])

    def way(self, start: Floats, goal: Floats, leaving: Ints, arriving: Ints) -> GridWay:
        """Search for the shortest way over the grid, from both ends in turn.

        Parameters
        ----------
        start, goal
            Places, shape (3,), metres.
        leaving, arriving
            Free cells that can be reached from them, index triples (n, 3).

        Returns
        -------
        way
            Centres of cells in order.

        """
        if not len(leaving) or not len(arriving):
            return GridWay(None, False)
        if self.pockets_of(leaving).isdisjoint(self.pockets_of(arriving)):
            return GridWay(None, True)
        limit = _FIRST_LIMIT
        while True:
            for swapped in (False, True):
                ends = (
                    (goal, start, arriving, leaving)
                    if swapped
                    else (start, goal, leaving, arriving)
                )
                code, last = self._search(*ends, limit=limit)
                if code == "found":
                    points = self.centres(self._traced(last))
                    return GridWay(points if swapped else points[::-1], False)
                if code == "exhausted":
                    self._close_pocket()
                    return GridWay(None, True)
            if self._used * self._width**3 > MOST_CELLS or limit > MOST_CELLS:
                return GridWay(None, False)
            limit *= 4

    def _search(
        self, start: Floats, goal: Floats, leaving: Ints, arriving: Ints, *, limit: int
    ) -> tuple[str, int]:
        """What a search of at most ``limit`` cells came to, and the last cell of its way."""
        from planner.airspace import roadmap_kernels as kernels

        self._stamp += 1
        at_goal = (goal - self._low) / self.cell - 0.5
        exits, exit_costs = self._flat(arriving), _grid_distances(arriving - at_goal)
        keys, cells = np.empty(4096), np.empty(4096, dtype=np.int64)
        state = np.zeros(4, dtype=np.int64)
        row, place = self._places(leaving)
        self._flags[row, place], self._stamps[row, place] = kernels.FREE, self._stamp
        self._before[row, place] = _NO_STEP
        lengths = np.linalg.norm(self.centres(leaving) - start, axis=1) / self.cell
        self._reach[row, place] = lengths
        ahead = _grid_distances(leaving - at_goal)
        for key, cell in zip(lengths + ahead, self._flat(leaving), strict=True):
            state[0] = kernels.push(keys, cells, state[0], key, cell)
        while True:
            code = kernels.search(
                self._shape, self._slots, self._flags, self._reach, self._before, self._stamps,
                self._stamp, at_goal, exits, exit_costs, keys, cells, state, limit,
            )  # fmt: skip
            if code == kernels.UNKNOWN_TILE:
                self._look(int(state[1]))
            elif code == kernels.FULL_HEAP:
                keys, cells = np.resize(keys, 2 * len(keys)), np.resize(cells, 2 * len(cells))
            else:
                names = {kernels.FOUND: "found", kernels.EXHAUSTED: "exhausted"}
                return names.get(code, "spent"), int(state[3])

    def _traced(self, last: int) -> Ints:
        """Index triples of the cells of a way, from its last to its first."""
        index = np.array(np.unravel_index(last, self._shape.tolist()))
        found = [index]
        while True:
            row, at = self._places(index[None])
            step = int(self._before[row[0], at[0]])
            if step == _NO_STEP:
                return np.array(found)
            index = index - (np.array([step // 9, step // 3 % 3, step % 3]) - 1)
            found.append(index)

    def pockets_of(self, cells: Ints) -> set[int]:
        """Numbers of the closed parts of the grid that cells lie in, 0 for in none so far."""
        row, at = self._places(cells)
        return set(self._pocket[row, at].tolist())

    def _close_pocket(self) -> None:
        """Number the cells that the last search reached: there is no way out of them."""
        self._pockets += 1
        self._pocket[self._stamps == self._stamp] = self._pockets

    def _look(self, tile: int) -> None:
        """Find the free cells of a tile."""
        if self._used == len(self._flags):
            self._grow()
        first = np.array(np.unravel_index(tile, self._tiles.tolist())) * self._width
        free = self._free_cells(first)
        self._flags[self._used] = free
        self._slots[tile] = self._used
        self._used += 1

    def _free_cells(self, first: Ints) -> Bytes:
        """Whether each cell of the tile that starts at cell ``first`` is free, shape (512,).

        One value decides a whole block of cells where it is far enough from the limit.
        """
        free = np.zeros(self._width**3, dtype=np.uint8)
        blocks, width = np.zeros((1, 3), dtype=np.int64), self._width
        while len(blocks):
            at = self._low + (first + blocks + 0.5 * width) * self.cell
            radius = 0.5 * _STRETCH * (width - 1) * self.cell
            lowest, highest = self._clearance(at)
            zones = self._zone_margin(at) - self._least_zone
            every = np.minimum(lowest - self._least, zones) >= radius
            none = np.minimum(highest - self._least, zones) < -radius
            cells = blocks[every][:, None] + _block(width)
            free[cells @ np.array([self._width**2, self._width, 1])] = 1
            blocks, width = blocks[~(every | none)], width // 2
            if width:
                blocks = (blocks[:, None] + _block(2) * width).reshape(-1, 3)
        inside = (first + _block(self._width) < self._shape).all(axis=1)
        return free * inside.astype(np.uint8)

    def _tile_of(self, index: Ints) -> Ints:
        tile = index // self._width
        return np.asarray((tile[:, 0] * self._tiles[1] + tile[:, 1]) * self._tiles[2] + tile[:, 2])

    def _places(self, index: Ints) -> tuple[Ints, Ints]:
        """Row and place in the pool of cells whose tiles have been looked at."""
        inner = index % self._width
        at = (inner[:, 0] * self._width + inner[:, 1]) * self._width + inner[:, 2]
        return self._slots[self._tile_of(index)].astype(np.int64), at

    def _flat(self, index: Ints) -> Ints:
        return np.asarray(
            (index[:, 0] * self._shape[1] + index[:, 1]) * self._shape[2] + index[:, 2]
        )

    def _grow(self) -> None:
        """Make room for twice as many tiles."""
        rows = max(64, len(self._flags))
        self._flags, self._reach, self._before, self._stamps, self._pocket = (
            np.concatenate([pool, np.zeros((rows, self._width**3), pool.dtype)])
            for pool in (self._flags, self._reach, self._before, self._stamps, self._pocket)
        )


@cache
def _block(width: int) -> Ints:
    """All index triples below ``width``, shape (width ** 3, 3)."""
    steps = np.meshgrid(*3 * [np.arange(width)], indexing="ij")
    block = np.stack(steps, axis=-1).reshape(-1, 3)
    block.setflags(write=False)  # it is kept
    return block


def _grid_distances(steps: Floats) -> Floats:
    """Lengths of the shortest ways over such differences, (n, 3), by steps to neighbours."""
    least, middle, most = np.sort(np.abs(steps), axis=1).T
    return np.asarray(np.sqrt(3.0) * least + np.sqrt(2.0) * (middle - least) + (most - middle))
