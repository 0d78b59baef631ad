"""The ground as a closed sheet of triangles that no flight can pass."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats, read_only
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground

_MOST_CELLS = 250_000  # larger grids are merged, keeping the highest of each block


@dataclass(frozen=True, slots=True, eq=False)
class Terrain:
    """A continuous terrain that is nowhere below the stepped :class:`Ground`.

    Heights live at the corners of the ground's cells, each the highest of the four cells that
    meet there; between corners the surface is flat on triangles. Beyond the rim it goes on level.

    Parameters
    ----------
    corners
        Height at each corner, shape (nx + 1, ny + 1), metres, local frame.
    origin
        Position x, y of the first corner, shape (2,), metres.
    cell
        Distance between corners, metres.

    """

    corners: Floats
    origin: Floats
    cell: float

    def __post_init__(self) -> None:
        corners = read_only(self.corners, (None, None), name="corners")
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "origin", read_only(self.origin, (2,), name="origin"))

    @property
    def high(self) -> Floats:
        """Position x, y of the last corner, shape (2,), metres."""
        return np.asarray(self.origin + (np.array(self.corners.shape) - 1) * self.cell)

    def height(self, xy: Floats) -> Floats:
        """Height of the sheet under each point, shape (N, 2) or (N, 3), metres."""
        last = np.array(self.corners.shape) - 1
        at = ((np.asarray(xy)[:, :2] - self.origin) / self.cell).clip(0.0, last)
        i, j = np.minimum(at.astype(np.int64), last - 1).T
        u, v = at[:, 0] - i, at[:, 1] - j
        low, far = self.corners[i, j], self.corners[i + 1, j + 1]
        along_x, along_y = self.corners[i + 1, j], self.corners[i, j + 1]
        below = low + u * (along_x - low) + v * (far - along_x)  # triangle where u >= v
        above = low + v * (along_y - low) + u * (far - along_y)
        return np.asarray(np.where(u >= v, below, above))

    def mesh(self, low: Floats, high: Floats) -> Mesh:
        """Triangles, facing up, that cover at least the rectangle from ``low`` to ``high`` (2,)."""
        (nx, ny), end = self.corners.shape, self.high
        x = self.origin[0] + np.arange(nx) * self.cell
        y = self.origin[1] + np.arange(ny) * self.cell
        reach = self.cell
        x = np.r_[min(low[0], x[0] - reach), x, max(high[0], end[0] + reach)]
        y = np.r_[min(low[1], y[0] - reach), y, max(high[1], end[1] + reach)]
        heights = np.pad(self.corners, 1, mode="edge")
        across, along = np.meshgrid(x, y, indexing="ij")
        vertices = np.stack([across, along, heights], axis=-1).reshape(-1, 3)
        row = np.arange(heights.size).reshape(heights.shape)
        a, b, c, d = row[:-1, :-1], row[1:, :-1], row[1:, 1:], row[:-1, 1:]
        triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        return Mesh(vertices, triangles)


def terrain(ground: Ground) -> Terrain:
    """Build the sheet over a stepped ground; conservative, so never below it.

    Parameters
    ----------
    ground
        Terrain heights by cell.

    Returns
    -------
    terrain
        Its sheet; huge grids are merged to blocks of cells, each as high as its highest cell.

    """
    heights, cell = np.asarray(ground.heights), ground.cell
    block = int(np.ceil(np.sqrt(heights.size / _MOST_CELLS)))
    if block > 1:
        pad = [(0, -n % block) for n in heights.shape]
        padded = np.pad(heights, pad, mode="edge")
        nx, ny = padded.shape[0] // block, padded.shape[1] // block
        heights, cell = padded.reshape(nx, block, ny, block).max(axis=(1, 3)), cell * block
    wide = np.pad(heights, 1, mode="edge")
    corners = np.maximum(
        np.maximum(wide[:-1, :-1], wide[1:, :-1]), np.maximum(wide[:-1, 1:], wide[1:, 1:])
    )
    return Terrain(corners, ground.origin, cell)
