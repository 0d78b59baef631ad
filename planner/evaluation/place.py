"""A place made ready for choosing photos, once, so that every choice meets the same one."""

from dataclasses import replace

import numpy as np

from planner.airspace.candidates import candidate_positions
from planner.attempts import Prior, study
from planner.clock import Clock
from planner.config import Config
from planner.scale import Scale
from planner.scene.scene import Scene
from planner.surface.quality import score_quality
from planner.surface.reconstruct import reconstruct_surface
from planner.surface.samples import ScoredSamples, Surface


def prepare(scene: Scene, config: Config) -> Prior:
    """Run the stages before the choice of photos, as a plan does."""
    return study(scene, config, Clock(None))


def coarser(place: Prior, factor: float) -> Prior:
    """The same place with a larger radius R and voxels as much wider; lengths of flight stay."""
    samples = fresh_samples(place, factor=factor)
    grid = candidate_positions(
        place.airspace,
        box=place.scene.box,
        voxel=factor * place.voxel,
        limit=place.config.viewpoints.max_candidates,
        margin=place.config.flight.margin,
    )
    return replace(place, samples=samples, positions=grid.positions, voxel=grid.voxel)


def fresh_samples(place: Prior, *, factor: float = 1.0, seed: int = 0) -> ScoredSamples:
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
