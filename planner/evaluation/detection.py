"""How well the quality of a prior finds holes, thinned and noisy patches that were made in it."""

from dataclasses import dataclass, replace

import numpy as np

from planner.evaluation.damage import (
    Damage,
    Kind,
    apply_damages,
    damaged_samples,
    place_damages,
    roc_auc,
    untouched_samples,
)
from planner.geometry.arrays import Bools, Floats
from planner.scene.cloud import PointCloud
from planner.scene.scene import Scene
from planner.surface.reconstruct import reconstruct_surface
from planner.surface.samples import Surface

KINDS: tuple[Kind, ...] = ("hole",) * 8 + ("thinned", "noisy") * 4
_KNOWN = 5  # neighbours before the damage that make a sample count


@dataclass(frozen=True, slots=True, eq=False)
class DamagedPrior:
    """A damaged scene, the surface reconstructed from it, and what is truly damaged.

    Parameters
    ----------
    scene
        The scene with its damaged cloud.
    surface
        Reconstructed from the damaged cloud alone.
    damages
        What was done.
    positives
        Which samples are damaged, by kind, each of shape (S,).
    negatives
        Which samples are known to be as they were, shape (S,).

    """

    scene: Scene
    surface: Surface
    damages: tuple[Damage, ...]
    positives: dict[Kind, Bools]
    negatives: Bools


@dataclass(frozen=True, slots=True)
class Detection:
    """Areas under the ROC curve of low quality as a detector, each against the negatives.

    Parameters
    ----------
    holes, thinned, noisy
        Of one kind of damage.
    patches
        Of thinned and noisy patches taken together.

    """

    holes: float
    patches: float
    thinned: float
    noisy: float


def damage_prior(
    scene: Scene, intact: Surface, *, poisson_depth: int, seed: int, kinds: tuple[Kind, ...] = KINDS
) -> DamagedPrior:
    """Damage a scene in balls of 2 to 5 R and reconstruct it anew.

    Balls are centred on samples of the intact surface with at least five points within R, and stay
    2 R apart. Noise has a standard deviation of R/2 along each axis. A sample of the new surface
    counts only if the intact cloud has at least five points within R of it. It is positive within
    0.8 of a ball's radius, and negative if it is more than R away from every ball, so that nothing
    in its neighbourhood has changed; in between it does not count.

    Parameters
    ----------
    scene
        Intact scene.
    intact
        Its surface.
    poisson_depth
        Of both surfaces.
    seed
        Of places, sizes, thinning and noise.
    kinds
        Kind of each ball.

    Returns
    -------
    prior
        Damaged scene, its surface, and the labels.

    """
    radius = intact.samples.radius
    known = _counts(intact.samples.xyz, scene.cloud, radius) >= _KNOWN
    damages = place_damages(
        intact.samples.xyz[known],
        kinds,
        smallest=2.0 * radius,
        largest=5.0 * radius,
        gap=2.0 * radius,
        seed=seed,
    )
    cloud = apply_damages(scene.cloud, damages, noise=0.5 * radius, seed=seed)
    damaged = replace(scene, cloud=cloud)
    surface = reconstruct_surface(damaged, radius=radius, poisson_depth=poisson_depth)
    xyz = surface.samples.xyz
    known = _counts(xyz, scene.cloud, radius) >= _KNOWN
    owner = damaged_samples(xyz, damages)
    kind = np.array([damage.kind for damage in damages])[owner]
    positives: dict[Kind, Bools] = {
        name: known & (owner >= 0) & (kind == name) for name in ("hole", "thinned", "noisy")
    }
    negatives = known & untouched_samples(xyz, damages, margin=radius)
    return DamagedPrior(damaged, surface, damages, positives, negatives)


def neighbour_baseline(prior: DamagedPrior) -> Floats:
    """Plain number of points within R of each sample, shape (S,): the score to beat."""
    samples = prior.surface.samples
    return _counts(samples.xyz, prior.scene.cloud, samples.radius)


def detection(prior: DamagedPrior, quality: Floats) -> Detection:
    """Areas under the ROC curve of a score, shape (S,), that is low where the prior is bad."""

    def area(bad: Bools) -> float:
        counted = bad | prior.negatives
        return roc_auc(quality[counted], bad[counted])

    positives = prior.positives
    return Detection(
        area(positives["hole"]),
        area(positives["thinned"] | positives["noisy"]),
        area(positives["thinned"]),
        area(positives["noisy"]),
    )


def _counts(at: Floats, cloud: PointCloud, radius: float) -> Floats:
    from scipy.spatial import cKDTree

    counts = cKDTree(cloud.xyz).query_ball_point(at, radius, return_length=True)
    return np.asarray(counts, dtype=np.float64)
