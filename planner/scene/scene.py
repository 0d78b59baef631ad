"""The scene that all stages plan in."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats, read_only
from planner.geometry.frames import Frame
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.images import Images


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """A box with one vertical axis, turned to the scene's dominant directions.

    Parameters
    ----------
    centre
        Shape (3,), metres, local frame.
    axes
        Unit axes as rows, shape (3, 3), right-handed; the last is (0, 0, 1).
    size
        Full lengths along the axes, shape (3,), metres.

    """

    centre: Floats
    axes: Floats
    size: Floats

    def __post_init__(self) -> None:
        for name, shape in (("centre", (3,)), ("axes", (3, 3)), ("size", (3,))):
            object.__setattr__(self, name, read_only(getattr(self, name), shape, name=name))

    def contains(self, points: Floats, *, margin: float = 0.0) -> np.ndarray:
        """Tell which points, shape (N, 3), lie in the box grown by ``margin`` metres."""
        local = (points - self.centre) @ self.axes.T
        return np.asarray((np.abs(local) <= 0.5 * self.size + margin).all(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Height of the terrain on a regular grid, nearest cell, clamped at its rim.

    Parameters
    ----------
    heights
        Terrain height of each cell, shape (nx, ny), metres, local frame.
    origin
        Lowest corner x, y of the grid, shape (2,), metres.
    cell
        Cell width, metres.

    """

    heights: Floats
    origin: Floats
    cell: float

    def __post_init__(self) -> None:
        heights = read_only(self.heights, (None, None), name="heights")
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "origin", read_only(self.origin, (2,), name="origin"))

    def height(self, xy: Floats) -> Floats:
        """Terrain height under each point, shape (N, 2) or (N, 3), metres."""
        index = np.floor((np.asarray(xy)[:, :2] - self.origin) / self.cell).astype(np.int64)
        index = np.clip(index, 0, np.array(self.heights.shape) - 1)
        return self.heights[index[:, 0], index[:, 1]]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A place as it is known before the flight that is to be planned.

    Parameters
    ----------
    name
        Short name, usually the file's stem.
    cloud
        All points that survived cleaning, not thinned; of a mesh, samples of its surface.
    mesh
        The mesh, where the source was one, else ``None``.
    ground
        Terrain under the scene.
    box
        Bounding box along the dominant axes.
    frame
        Where the local frame lies in the world.
    metric
        Whether the source's unit is known (so that an absolute allowance makes sense).
    source
        Path of the file that was read, or ``None`` for a synthetic scene.
    sha256
        Hash of that file, or of the synthetic arrays.
    notes
        What reading found and decided, one sentence each, for the report.
    strays
        Points that cleaning dropped, shape (K, 3), metres, local frame, or ``None``: noise as a
        rule, but a wire or a mast's tip may be among them, so that flight should avoid them too.
    images
        Photos of the first flight whose poses are known, or ``None``.

    """

    name: str
    cloud: PointCloud
    mesh: Mesh | None
    ground: Ground
    box: Box
    frame: Frame
    metric: bool = True
    source: str | None = None
    sha256: str = ""
    notes: tuple[str, ...] = ()
    strays: Floats | None = None
    images: Images | None = None

    def __post_init__(self) -> None:
        if self.strays is not None:
            object.__setattr__(self, "strays", read_only(self.strays, (None, 3), name="strays"))
