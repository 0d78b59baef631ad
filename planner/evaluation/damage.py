"""Damage a cloud in known places, and measure how well a score finds them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.geometry.arrays import Bools, Floats, Ints
from planner.scene.cloud import PointCloud

Kind = Literal["hole", "thinned", "noisy"]


@dataclass(frozen=True, slots=True)
class Damage:
    """A ball in which the cloud is damaged.

    Parameters
    ----------
    kind
        ``hole``: no point is left; ``thinned``: a quarter is; ``noisy``: all move.
    centre
        Position, metres.
    radius
        Metres.

    """

    kind: Kind
    centre: tuple[float, float, float]
    radius: float

    def distance(self, points: Floats) -> Floats:
        """Distance of each point, shape (N, 3), to the centre as a share of the radius."""
        return np.asarray(np.linalg.norm(points - np.array(self.centre), axis=1) / self.radius)


def place_damages(
    places: Floats,
    kinds: tuple[Kind, ...],
    *,
    smallest: float,
    largest: float,
    gap: float,
    seed: int,
) -> tuple[Damage, ...]:
    """Choose where to damage: one ball of each kind, in order, none near another.

    Parameters
    ----------
    places
        Where a ball may be centred, shape (M, 3), metres.
    kinds
        Kind of each ball.
    smallest, largest
        Bounds of the radius, which is drawn uniformly, metres.
    gap
        Room that must stay between two balls, metres.
    seed
        Of places and radii.

    Returns
    -------
    damages
        As many as there are kinds.

    Raises
    ------
    ValueError
        If there is no room for them all.

    """
    rng = np.random.default_rng(seed)
    found: list[Damage] = []
    for kind in kinds:
        radius = float(rng.uniform(smallest, largest))
        free = np.ones(len(places), dtype=bool)
        for other in found:
            room = (radius + other.radius + gap) / other.radius
            free &= other.distance(places) >= room
        if not free.any():
            raise ValueError(f"no room for {len(kinds)} balls of {smallest} to {largest} m.")
        centre = places[rng.choice(np.flatnonzero(free))]
        found.append(Damage(kind, (float(centre[0]), float(centre[1]), float(centre[2])), radius))
    return tuple(found)


def cut_hole(cloud: PointCloud, inside: Bools) -> PointCloud:
    """Return the cloud without the points ``inside``."""
    return cloud.take(~inside)


def thin_patch(
    cloud: PointCloud, inside: Bools, rng: np.random.Generator, *, share: float = 0.25
) -> PointCloud:
    """Return the cloud with only ``share`` of the points ``inside``, chosen by chance."""
    rows = np.flatnonzero(inside)
    keep = ~inside
    keep[rng.choice(rows, round(share * len(rows)), replace=False)] = True
    return cloud.take(keep)


def add_noise(
    cloud: PointCloud, inside: Bools, rng: np.random.Generator, *, sigma: float
) -> PointCloud:
    """Return the cloud with the points ``inside`` moved, normally by ``sigma`` metres an axis."""
    xyz = cloud.xyz.copy()
    xyz[inside] += rng.normal(scale=sigma, size=(int(inside.sum()), 3))
    return PointCloud(xyz, None, cloud.colours, cloud.classes)


def apply_damages(
    cloud: PointCloud, damages: tuple[Damage, ...], *, noise: float, seed: int
) -> PointCloud:
    """Return the cloud with every damage done to it; normals, no longer true, are dropped.

    Parameters
    ----------
    cloud
        The intact cloud, metres.
    damages
        Disjoint balls.
    noise
        Standard deviation along each axis in noisy balls, metres.
    seed
        Of the points that are kept and moved.

    Returns
    -------
    damaged
        What is left.

    """
    rng = np.random.default_rng(seed)
    cloud = PointCloud(cloud.xyz, None, cloud.colours, cloud.classes)
    for damage in damages:
        inside = damage.distance(cloud.xyz) <= 1.0
        if damage.kind == "hole":
            cloud = cut_hole(cloud, inside)
        elif damage.kind == "thinned":
            cloud = thin_patch(cloud, inside, rng)
        else:
            cloud = add_noise(cloud, inside, rng, sigma=noise)
    return cloud


def damaged_samples(samples: Floats, damages: tuple[Damage, ...], *, core: float = 0.8) -> Ints:
    """Row of the damage in whose core (a share of its radius) each sample lies, else -1."""
    owner = np.full(len(samples), -1, np.int64)
    for row, damage in enumerate(damages):
        owner[damage.distance(samples) <= core] = row
    return owner


def untouched_samples(samples: Floats, damages: tuple[Damage, ...], *, margin: float) -> Bools:
    """Tell which samples have no damage within ``margin`` metres."""
    free = np.ones(len(samples), dtype=bool)
    for damage in damages:
        free &= damage.distance(samples) * damage.radius > damage.radius + margin
    return free


def roc_auc(quality: Floats, bad: Bools) -> float:
    """Area under the ROC curve of low quality as a detector of what is bad.

    Parameters
    ----------
    quality
        Score of each sample, shape (S,), high is good.
    bad
        Which are truly bad, shape (S,).

    Returns
    -------
    area
        Chance that a bad sample scores lower than a good one, ties counting half; NaN if either
        kind is missing.

    """
    from scipy.stats import rankdata

    positives, negatives = int(bad.sum()), int((~bad).sum())
    if positives == 0 or negatives == 0:
        return float("nan")
    ranks = rankdata(-quality)
    wins = ranks[bad].sum() - positives * (positives + 1) / 2
    return float(wins / (positives * negatives))
