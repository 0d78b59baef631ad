"""Gentle ground of a few long waves, as a sheet of triangles and as a grid of heights."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Bytes, Floats
from planner.scene.scene import Ground
from planner.scene.town.building import Kind
from planner.scene.town.solids import Solid

GROUND_CELL = 2.5  # metres
MERGE = 0.01  # metres below which two grid lines are one


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """Sum of three plane waves, metres.

    Parameters
    ----------
    waves
        Wave vectors, shape (3, 2), radians a metre.
    phases
        Shape (3,), radians.
    amplitude
        Largest height above or below zero, metres.

    """

    waves: Floats
    phases: Floats
    amplitude: float

    def height(self, xy: Floats) -> Floats:
        """Height at each point, shape (..., 2) -> (...), metres."""
        angle = np.asarray(xy)[..., None, :2] * self.waves
        waves = np.sin(angle.sum(axis=-1) + self.phases)
        return np.asarray(self.amplitude * waves.mean(axis=-1))


def random_relief(amplitude: float, rng: np.random.Generator) -> Relief:
    """Waves of 70 to 200 m length in any direction."""
    heading = rng.uniform(0.0, 2.0 * np.pi, 3)
    number = 2.0 * np.pi / rng.uniform(70.0, 200.0, 3)
    waves = number[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return Relief(waves, rng.uniform(0.0, 2.0 * np.pi, 3), amplitude)


def sheet(
    size: tuple[float, float], terrain: Relief, marks: list[tuple[Floats, Kind]]
) -> tuple[Solid, Bytes]:
    """Triangulated grid over the whole place, cut along marked rectangles.

    Parameters
    ----------
    size
        Lengths along x and y, centred on the origin, metres.
    terrain
        Heights.
    marks
        Lowest and highest corner of each marked rectangle, (2, 2), and its kind; later ones win.

    Returns
    -------
    solid, kinds
        Open sheet that faces up, and what each of its triangles is.

    """
    edges = np.concatenate([np.zeros((0, 2)), *(bounds for bounds, _ in marks)])
    x, y = (_lines(0.5 * length, edges[:, axis]) for axis, length in enumerate(size))
    nx, ny = len(x) - 1, len(y) - 1
    xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices = np.column_stack([xy, terrain.height(xy)])
    a = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    b, c, d = a + ny + 1, a + ny + 2, a + 1
    triangles = np.stack([np.column_stack([a, b, c]), np.column_stack([a, c, d])], axis=1)
    triangles = triangles.reshape(-1, 3)
    centre = xy[triangles].mean(axis=1)
    kinds = np.full(len(triangles), Kind.GROUND, dtype=np.uint8)
    for (low, high), kind in marks:
        kinds[((centre >= low) & (centre <= high)).all(axis=1)] = kind
    return Solid(vertices, triangles), kinds


def _lines(half: float, edges: Floats) -> Floats:
    """Grid lines from -half to half through all edges, at most a cell apart."""
    inside = edges[np.abs(edges) < half - MERGE]
    stops = np.unique(np.concatenate([[-half, half], inside]))
    stops = stops[np.append(np.diff(stops) > MERGE, True)]
    counts = np.ceil(np.diff(stops) / GROUND_CELL).astype(int)
    pieces = [
        np.linspace(a, b, count, endpoint=False)
        for a, b, count in zip(stops[:-1], stops[1:], counts, strict=True)
    ]
    return np.append(np.concatenate(pieces), half)


def height_grid(size: tuple[float, float], terrain: Relief, turn: float) -> Ground:
    """Terrain heights on a grid along x and y over the turned place, cells of 1 m."""
    c, s = abs(np.cos(turn)), abs(np.sin(turn))
    half = 0.5 * np.array([c * size[0] + s * size[1], s * size[0] + c * size[1]])
    count = np.ceil(2.0 * half).astype(int) + 1
    centres = [np.arange(n) + 0.5 - h for n, h in zip(count, half, strict=True)]
    xy = np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1)
    return Ground(terrain.height(xy @ rotation(-turn).T), -half, 1.0)


def rotation(turn: float) -> Floats:
    """Matrix that turns map positions counter-clockwise by so many radians, shape (2, 2)."""
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s], [s, c]])
