"""The quality finds holes, thinned and noisy patches that were made in real and synthetic scans."""

from dataclasses import astuple

import numpy as np
import pytest

from planner.config import QualitySettings
from planner.evaluation.detection import Detection, damage_prior, detection, neighbour_baseline
from planner.scene.load import load_scene
from planner.scene.synthetic import synthetic_scene
from planner.surface.quality import score_quality
from planner.surface.reconstruct import reconstruct_surface

SHARE, DEPTH = 0.015, 8  # what planner.scale derives


def quality(prior, **options):
    return score_quality(
        prior.surface.samples,
        prior.scene.cloud,
        thinned=prior.surface.thinned,
        settings=QualitySettings(**options),
    ).quality


@pytest.mark.slow
@pytest.mark.parametrize("source", ["brighton_beach_odm.laz", "toronto_city_hall.laz", "synthetic"])
def test_low_quality_finds_what_was_damaged(source, shared_data):
    folder = shared_data / "scenes" / "pointclouds"
    scene = synthetic_scene(0) if source == "synthetic" else load_scene(folder / source)
    radius = SHARE * float(scene.box.size.max())
    intact = reconstruct_surface(scene, radius=radius, poisson_depth=DEPTH)
    priors = [damage_prior(scene, intact, poisson_depth=DEPTH, seed=seed) for seed in (0, 1)]

    def areas(score):
        return np.mean([astuple(detection(prior, score(prior))) for prior in priors], axis=0)

    found = Detection(*areas(quality))
    count = Detection(*areas(neighbour_baseline))
    printed = Detection(*areas(lambda prior: quality(prior, density_weight="printed")))
    assert found.holes >= max(0.90, count.holes)
    assert found.patches >= max(0.80, count.patches + 0.05)
    assert printed.thinned < 0.5 < found.thinned  # as printed, Eq. 1 prefers what is thin


def test_labels_name_what_is_damaged_and_what_is_not():
    scene = synthetic_scene(1, size=(50.0, 45.0), buildings=5, spacing=0.6)
    radius = 0.02 * float(scene.box.size.max())
    intact = reconstruct_surface(scene, radius=radius, poisson_depth=6)
    kinds = ("hole", "thinned", "noisy")
    prior = damage_prior(scene, intact, poisson_depth=6, seed=3, kinds=kinds)
    xyz = prior.surface.samples.xyz
    assert not (prior.negatives & np.any(list(prior.positives.values()), axis=0)).any()
    for damage in prior.damages:
        marked = prior.positives[damage.kind]
        assert marked.any()
        assert damage.distance(xyz[marked]).max() <= 0.8
        assert damage.distance(xyz[prior.negatives]).min() * damage.radius > damage.radius + radius
    counts = neighbour_baseline(prior)
    assert np.median(counts[prior.positives["hole"]]) == 0.0
    assert counts[prior.negatives].min() >= 5
    truth = np.where(prior.negatives, 1.0, 0.0)
    assert detection(prior, truth).holes == detection(prior, truth).patches == 1.0
