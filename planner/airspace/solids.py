"""Everything solid of a scene: surfaces, raw points, curtains and, if wanted, the unknown."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.airspace.occupancy import Occupancy, occupancy
from planner.airspace.terrain import Terrain
from planner.airspace.unknown import unknown_space
from planner.config import AirspaceSettings
from planner.geometry.arrays import Floats
from planner.scene.cloud import Mesh
from planner.scene.images import Images
from planner.scene.scene import Scene

UNTOLD_DEG = 60.0
"""How far from straight down a first flight is thought to have looked, if nothing tells."""

HALF_DIAGONAL_DEG = 42.0
"""Half the diagonal field of view of a photo whose optics are not known."""

WIDEST_DEG = 75.0
"""Lines nearer to the horizon than this are not believed in, whatever photos say."""


@dataclass(frozen=True, slots=True, eq=False)
class Solids:
    """What is solid besides the terrain, and what the sky reaches between.

    Parameters
    ----------
    surface
        Surface, and the faces of unknown space where that is closed.
    curtains
        Faces around what is filled under roofs.
    points
        Raw points with those that cleaning dropped, shape (P, 3), metres: the tip of a mast is
        lonely too.
    occupancy
        Cells of the sky.

    """

    surface: Mesh
    curtains: Mesh
    points: Floats
    occupancy: Occupancy


def collect_solids(
    scene: Scene,
    surface: Mesh,
    sheet: Terrain,
    bounds: tuple[Floats, Floats],
    *,
    d_min: float,
    settings: AirspaceSettings,
) -> Solids:
    """Flood a scene, close what was never seen if that is asked for, and flood it again.

    Parameters
    ----------
    scene
        Raw points.
    surface
        Its surface, local metres.
    sheet
        Its terrain.
    bounds
        Lowest and highest corner of the space in which flight is considered, each (3,), metres.
    d_min
        Wanted clearance, metres.
    settings
        Grid, roofs, the unknown.

    """
    points = scene.cloud.xyz
    if scene.strays is not None:
        points = np.vstack([points, scene.strays])

    def flooded(mesh: Mesh) -> tuple[Occupancy, Mesh]:
        return occupancy(
            mesh,
            sheet,
            points,
            d_min=d_min,
            under_roofs=settings.fill_under_roofs,
            most_cells=settings.most_cells,
        )

    grid, curtains = flooded(surface)
    if settings.unknown == "closed":
        low, high = bounds
        floor = sheet.mesh(low[:2], high[:2])
        closed = unknown_space(
            joined((surface, floor, curtains)),
            scene.cloud.xyz,
            points,
            grid,
            ground=sheet,
            bounds=bounds,
            d_min=d_min,
            seen_within_deg=looked_within(scene.images)
            if settings.seen_within_deg is None
            else settings.seen_within_deg,
        )
        surface = joined((surface, closed))
        grid, curtains = flooded(surface)
    return Solids(surface, curtains, points, grid)


def looked_within(images: Images | None) -> float:
    """How far from straight down a first flight looked, degrees in [1, :data:`WIDEST_DEG`].

    To the corner of the picture of half of its photos; of photos whose optics are not known, that
    is taken to be :data:`HALF_DIAGONAL_DEG`. Without photos, :data:`UNTOLD_DEG`.
    """
    if images is None or not len(images):
        return UNTOLD_DEG
    width, height, focal = images.optics.T
    half = np.degrees(np.arctan2(0.5 * np.hypot(width, height), focal))
    corner = 90.0 + images.pitch_deg + np.where(np.isfinite(half), half, HALF_DIAGONAL_DEG)
    return float(np.clip(np.median(corner), 1.0, WIDEST_DEG))


def joined(parts: Sequence[Mesh]) -> Mesh:
    """One mesh of all triangles, in order."""
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    triangles = [part.triangles + start for part, start in zip(parts, first, strict=False)]
    return Mesh(np.concatenate([p.vertices for p in parts]), np.concatenate(triangles))
