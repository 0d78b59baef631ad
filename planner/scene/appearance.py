"""Colours of a made-up town in the light of one afternoon."""

import numpy as np

from planner.geometry.arrays import Bools, Bytes, Floats, Ints
from planner.scene.first_flight import ray_scene
from planner.scene.sampling import triangle_normals
from planner.scene.town.block import Town
from planner.scene.town.building import Kind
from planner.scene.town.fittings import STOREY

_PLAIN = {  # red, green, blue
    Kind.STREET: (96, 96, 100),
    Kind.COURTYARD: (124, 146, 88),
    Kind.UNDER_BRIDGE: (96, 96, 100),
    Kind.BALCONY: (208, 204, 196),
    Kind.BRIDGE: (150, 152, 156),
    Kind.TRUNK: (104, 78, 56),
}
_LAWN, _PAVING = (126, 144, 92), (168, 162, 150)
_WALLS = (
    (222, 206, 176), (196, 120, 92), (204, 200, 192), (232, 222, 204),
    (184, 148, 112), (160, 164, 168), (214, 178, 128), (178, 92, 74),
)  # fmt: skip
_TILES = ((178, 84, 60), (158, 72, 56), (120, 82, 66), (92, 96, 106))
_FLATS = ((150, 148, 144), (126, 128, 130), (172, 166, 156))
_WINDOW = (74, 88, 104)
_SUN = np.array([0.45, -0.5, 0.74])
_AMBIENT = 0.52


def paint(town: Town, surface: Floats, triangles: Ints, *, seed: int) -> Bytes:
    """Colour points of a town by what they lie on, with windows, sunlight and cast shadows.

    Parameters
    ----------
    town
        The place.
    surface
        Points on its mesh, shape (N, 3), metres.
    triangles
        Triangle under each point, shape (N,).
    seed
        Seed of the palette and of the grain.

    Returns
    -------
    colours
        Red, green, blue, shape (N, 3), 0 to 255.

    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(2,)))
    normals, _ = triangle_normals(town.mesh)
    base = _triangle_colours(town, normals, rng)[triangles]
    normal = normals[triangles]
    glass = (town.kinds[triangles] == Kind.BUILDING) & _windows(town, surface, normal)
    base[glass] = _WINDOW
    light = _AMBIENT + (1.0 - _AMBIENT) * _sunlight(town, surface, normal)
    grain = rng.normal(1.0, 0.035, (len(surface), 1))
    return np.clip(base * light[:, None] * grain, 0.0, 255.0).astype(np.uint8)


def _triangle_colours(town: Town, normals: Floats, rng: np.random.Generator) -> Floats:
    """Unlit colour of each triangle, shape (T, 3)."""
    kinds, count = town.kinds, int(town.buildings.max()) + 1
    colours = np.zeros((len(kinds), 3))
    for kind, colour in _PLAIN.items():
        colours[kinds == kind] = colour
    share = float(rng.uniform(0.0, 0.8))
    colours[kinds == Kind.GROUND] = (1.0 - share) * np.array(_LAWN) + share * np.array(_PAVING)
    leaf = rng.uniform(0.8, 1.2, (int(town.parts.max()) + 1, 1)) * (84.0, 116.0, 58.0)
    crown = kinds == Kind.CROWN
    colours[crown] = leaf[town.parts[crown]]

    steep = normals[:, 2]
    for palette, chosen in (
        (_WALLS, steep <= 0.2),
        (_TILES, (steep > 0.2) & (steep < 0.98)),
        (_FLATS, steep >= 0.98),
    ):
        own = np.array(palette, dtype=np.float64)[rng.integers(0, len(palette), count)]
        rows = chosen & (kinds == Kind.BUILDING)
        colours[rows] = own[town.buildings[rows]]
    return colours


def _windows(town: Town, surface: Floats, normal: Floats) -> Bools:
    """Which points lie on a window, if they lie on a facade: one every 2.6 m on each floor."""
    along = -surface[:, 0] * normal[:, 1] + surface[:, 1] * normal[:, 0]
    up = (surface[:, 2] - town.ground.height(surface)) % STOREY
    across = along % 2.6
    return (np.abs(normal[:, 2]) < 0.2) & (np.abs(up - 1.6) < 0.75) & (np.abs(across - 1.3) < 0.65)


def _sunlight(town: Town, surface: Floats, normal: Floats) -> Floats:
    """Cosine of the sun's angle where it shines, 0 in shadow, shape (N,)."""
    sun = _SUN / np.linalg.norm(_SUN)
    facing = normal @ sun
    lit = np.flatnonzero(facing > 0.0)
    start = surface[lit] + 0.01 * normal[lit]
    rays = np.column_stack([start, np.broadcast_to(sun, start.shape)]).astype(np.float32)
    shade = ray_scene(town.mesh).test_occlusions(rays).numpy()
    light = np.zeros(len(surface))
    light[lit[~shade]] = facing[lit[~shade]]
    return light
