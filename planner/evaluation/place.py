"""A place made ready for choosing photos, once, so that every choice meets the same one."""

from dataclasses import dataclass, replace

import numpy as np

from planner.airspace.airspace import Airspace, build_airspace
from planner.airspace.candidates import candidate_positions
from planner.attempts import camera_of
from planner.config import Config
from planner.geometry.arrays import Floats
from planner.scale import Scale, derive_scale
from planner.scene.scene import Scene
from planner.surface.quality import score_quality
from planner.surface.reconstruct import reconstruct_surface
from planner.surface.samples import ScoredSamples, Surface
from planner.viewpoints.camera import Camera


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """What the choice of photos starts from.

    Parameters
    ----------
    config
        Settings.
    scene, camera, scale
        The place, the camera, and the lengths.
    surface, samples
        Surface, and its samples with quality.
    airspace
        Where flight is safe.
    positions
        Free positions, shape (V, 3), metres.
    voxel
        Their spacing, metres.

    """

    config: Config
    scene: Scene
    camera: Camera
    scale: Scale
    surface: Surface
    samples: ScoredSamples
    airspace: Airspace
    positions: Floats
    voxel: float

    @property
    def reference(self) -> float:
        """Distance at which a photo is worth nothing, metres: twice what just meets the GSD."""
        return 2.0 * self.scale.gsd * self.camera.focal_px


def prepare(scene: Scene, config: Config) -> Place:
    """Run the stages before the choice of photos, as a plan does."""
    camera = camera_of(config.camera)
    scale = derive_scale(scene, camera, config.scale)
    surface = _surface(scene, config, scale, radius=scale.radius, seed=config.seed)
    airspace = build_airspace(
        scene, surface.mesh, d_min=scale.d_min, d_max=scale.d_max, settings=config.airspace
    )
    most = config.viewpoints.max_candidates
    grid = candidate_positions(airspace, box=scene.box, voxel=scale.voxel, limit=most)
    return Place(
        *(config, scene, camera, scale, surface, _scored(surface, scene, config)),
        *(airspace, grid.positions, grid.voxel),
    )


def coarser(place: Place, factor: float) -> Place:
    """The same place with a larger radius R and voxels as much wider; lengths of flight stay."""
    samples = fresh_samples(place, factor=factor)
    grid = candidate_positions(
        place.airspace,
        box=place.scene.box,
        voxel=factor * place.voxel,
        limit=place.config.viewpoints.max_candidates,
    )
    return replace(place, samples=samples, positions=grid.positions, voxel=grid.voxel)


def fresh_samples(place: Place, *, factor: float = 1.0, seed: int = 0) -> ScoredSamples:
    """Other samples of the same surface, ``factor`` times as far apart.

    Parameters
    ----------
    place
        Where.
    factor
        Of the radius R.
    seed
        Of the samples, apart from the seed of the place.

    """
    scene = replace(place.scene, mesh=place.surface.mesh)
    draw = int(np.random.SeedSequence(place.config.seed, spawn_key=(1, seed)).generate_state(1)[0])
    radius = factor * place.scale.radius
    surface = _surface(scene, place.config, place.scale, radius=radius, seed=draw)
    return _scored(surface, place.scene, place.config)


def _surface(scene: Scene, config: Config, scale: Scale, *, radius: float, seed: int) -> Surface:
    return reconstruct_surface(
        scene,
        radius=radius,
        poisson_depth=scale.poisson_depth,
        settings=config.surface,
        normal_neighbours=config.scene.normal_neighbours,
        seed=seed,
    )


def _scored(surface: Surface, scene: Scene, config: Config) -> ScoredSamples:
    return score_quality(
        surface.samples, scene.cloud, thinned=surface.thinned, settings=config.quality
    )
