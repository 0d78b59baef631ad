"""A made-up town block with its ground truth, and what a first flight would know of it."""

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.geometry.arrays import Bytes, Floats, Ints, read_only
from planner.geometry.frames import Frame
from planner.scene.appearance import paint
from planner.scene.box import bounding_box
from planner.scene.cloud import Mesh, PointCloud
from planner.scene.first_flight import FlownCloud, NadirFlight, flown_images, fly_first
from planner.scene.ground import estimate_ground
from planner.scene.scene import Ground, Scene
from planner.scene.town.block import Town, build_town

_FLIGHT = NadirFlight()
_GROUND_CELL = 1.0  # metres
_CLASSES = np.array([2, 2, 2, 2, 6, 6, 17, 5, 5], dtype=np.uint8)  # LAS codes by Kind


@dataclass(frozen=True, slots=True, eq=False)
class SyntheticBlock:
    """Ground truth and coarse cloud of a made-up place; x, y centred, z up, metres.

    Parameters
    ----------
    name
        ``synthetic-<seed>``.
    mesh
        The truth: an open ground sheet, and closed solids with outward faces that stand in it.
    cloud
        What the first flight recovered, with LAS classes and colours; no points if not flown.
    cameras
        Positions of the first flight's cameras, shape (C, 3), metres.
    ground
        Height of the true terrain.
    kinds
        What each triangle is, shape (T,), codes of ``planner.scene.town.building.Kind``.
    parts
        Solid that each triangle belongs to, shape (T,); 0 is the ground.
    buildings
        Building that each triangle belongs to, counted from 0, shape (T,); -1 where none.
    truth
        Point of the mesh that each point of the cloud was measured at, shape (N, 3), metres.
    sigma
        Standard deviation of the noise of each point of the cloud, shape (N,), metres.
    triangles
        Triangle of the mesh that each point of the cloud was measured on, shape (N,).
    turn
        Angle of the streets' first axis from +x, counter-clockwise, radians.
    flight
        How the first flight was flown, along that axis.

    """

    name: str
    mesh: Mesh
    cloud: PointCloud
    cameras: Floats
    ground: Ground
    kinds: Bytes
    parts: Ints
    buildings: Ints
    truth: Floats
    sigma: Floats
    triangles: Ints
    turn: float
    flight: NadirFlight = _FLIGHT

    def __post_init__(self) -> None:
        for name, shape, dtype in (
            ("cameras", (None, 3), np.float64),
            ("kinds", (len(self.mesh),), np.uint8),
            ("parts", (len(self.mesh),), np.int64),
            ("buildings", (len(self.mesh),), np.int64),
            ("truth", (len(self.cloud), 3), np.float64),
            ("sigma", (len(self.cloud),), np.float64),
            ("triangles", (len(self.cloud),), np.int64),
        ):
            values = read_only(getattr(self, name), shape, name=name, dtype=dtype)
            object.__setattr__(self, name, values)


def synthetic_block(
    seed: int,
    *,
    size: tuple[float, float] | None = (90.0, 70.0),
    buildings: int | None = None,
    heights: tuple[float, float] = (4.0, 40.0),
    relief: float | None = None,
    turn: float | None = None,
    bridge: bool = True,
    trees: bool = True,
    spacing: float | None = 0.25,
    flight: NadirFlight = _FLIGHT,
) -> SyntheticBlock:
    """Make up a town block; the same arguments give the same bytes.

    Parameters
    ----------
    seed
        Any integer from 0.
    size
        Lengths of the place along its streets, metres, 40 or more; ``None`` draws them.
    buildings
        How many; ``None`` draws 5 to 40, as the place has room.
    heights
        Least and largest height of a building above the ground under it, metres.
    relief
        Largest height of the ground above or below zero, metres; ``None`` draws 0 to 2.5.
    turn
        Angle of the streets from +x, radians; ``None`` draws it.
    bridge, trees
        Whether there are any.
    spacing
        Distance between the cloud's points on open ground, metres; ``None`` makes no cloud (the
        mesh alone takes a few milliseconds).
    flight
        How the first flight is flown.

    Returns
    -------
    block
        Truth, labels, and the cloud of the first flight.

    Raises
    ------
    ValueError
        If the place is too small for what is wanted.

    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0,)))
    drawn_size = (float(rng.uniform(60.0, 150.0)), float(rng.uniform(50.0, 110.0)))
    width, depth = drawn_size if size is None else size
    if not (40.0 <= width <= 2000.0 and 40.0 <= depth <= 2000.0):
        raise ValueError(f"size must be 40 to 2000 m each way, got {size}.")
    if not 3.0 <= heights[0] <= heights[1] < np.inf:
        raise ValueError(f"heights must rise from 3 m or more, got {heights}.")
    if buildings is not None and buildings < 1:
        raise ValueError(f"buildings must be 1 or more, got {buildings}.")
    if spacing is not None and not 0.0 < spacing < np.inf:
        raise ValueError(f"spacing must be above 0 m, got {spacing}.")
    if relief is not None and not 0.0 <= relief <= 5.0:
        raise ValueError(f"relief must be 0 to 5 m, got {relief}.")
    most = int(np.clip(width * depth / 155.0, 5, 40))
    drawn_buildings = int(rng.integers(5, most + 1))
    drawn_relief = float(rng.choice([0.0, rng.uniform(0.3, 2.5)]))
    drawn_turn = float(rng.uniform(0.0, 0.5 * np.pi))
    town = build_town(
        rng,
        size=(float(width), float(depth)),
        buildings=drawn_buildings if buildings is None else buildings,
        heights=heights,
        relief=drawn_relief if relief is None else relief,
        turn=drawn_turn if turn is None else turn,
        bridge=bridge,
        trees=trees,
    )
    return _observe(town, seed, spacing, flight)


def _observe(town: Town, seed: int, spacing: float | None, flight: NadirFlight) -> SyntheticBlock:
    """Fly over the town, unless no spacing is given, and colour what is seen."""
    none = np.zeros((0, 3))
    cloud, flown = PointCloud(none), FlownCloud.empty()
    if spacing is not None:
        flown = fly_first(town.mesh, flight, spacing=spacing, heading=town.turn, seed=seed)
        colours = paint(town, flown.surface, flown.triangles, seed=seed)
        classes = _CLASSES[town.kinds[flown.triangles]]
        cloud = PointCloud(flown.xyz, colours=colours, classes=classes)
    return SyntheticBlock(
        name=f"synthetic-{seed}",
        mesh=town.mesh,
        cloud=cloud,
        cameras=flown.cameras,
        ground=town.ground,
        kinds=town.kinds,
        parts=town.parts,
        buildings=town.buildings,
        truth=flown.surface,
        sigma=flown.sigma,
        triangles=flown.triangles,
        turn=town.turn,
        flight=flight,
    )


def synthetic_scene(
    seed: int, *, truth: bool = False, images: bool = False, **options: Any
) -> Scene:
    """Scene of a made-up block, as if the first flight's cloud had been read from a file.

    Parameters
    ----------
    seed
        Any integer from 0.
    truth
        Whether the scene carries the true mesh, as one read from a city model would.
    images
        Whether the poses of the first flight's photos are known.
    **options
        Those of :func:`synthetic_block`.

    Returns
    -------
    scene
        Ground and bounding box as estimated from the cloud; ``sha256`` of mesh and cloud.

    """
    return scene_of(synthetic_block(seed, **options), truth=truth, images=images)


def scene_of(block: SyntheticBlock, *, truth: bool = False, images: bool = False) -> Scene:
    """Scene of a block that is there already; see :func:`synthetic_scene`."""
    if len(block.cloud) == 0:
        raise ValueError("a scene needs the first flight's cloud; give a spacing.")
    cloud = block.cloud
    digest = hashlib.sha256()
    for array in (block.mesh.vertices, block.mesh.triangles, cloud.xyz, cloud.classes):
        digest.update(np.ascontiguousarray(array).tobytes())
    return Scene(
        name=block.name,
        cloud=cloud,
        mesh=block.mesh if truth else None,
        ground=estimate_ground(cloud.xyz, cell=_GROUND_CELL, classes=cloud.classes),
        box=bounding_box(cloud.xyz),
        frame=Frame(np.zeros(3)),
        sha256=digest.hexdigest(),
        notes=(f"Made up from a seed; {len(block.cameras)} photos of a simulated first flight.",),
        images=flown_images(block.cameras, block.flight, heading=block.turn) if images else None,
    )
