"""How well each variant of the quality finds damage: the tables of docs/quality.md.

Run it from the repository's root; the first argument is a folder of point clouds:

    python docs/comparisons/quality.py CLOUDS --seeds 5 > table.md
"""

import argparse
from collections.abc import Iterator
from dataclasses import astuple
from pathlib import Path

import numpy as np

from planner.config import CameraSettings, QualitySettings, ScaleSettings
from planner.evaluation.detection import DamagedPrior, damage_prior, detection, neighbour_baseline
from planner.scale import derive_scale
from planner.scene.load import load_scene
from planner.scene.scene import Scene
from planner.scene.synthetic import synthetic_scene
from planner.surface.quality import score_quality
from planner.surface.reconstruct import reconstruct_surface
from planner.viewpoints.camera import camera_of

CHOSEN = ("toronto_city_hall.laz", "brighton_beach_odm.laz", "delft_ahn3_part1.laz", "synthetic")
HELD_OUT = ("city3d_building_001.ply", "france_hangar_houses.laz")
PAPER = {"density_reference": "maximum", "smoothness": "sum", "clip_percent": 0.0}
VARIANTS = {
    "**default**": {},
    "reference: maximum": {"density_reference": "maximum"},
    "weight: printed": {"density_weight": "printed"},
    "gradient: smoothed": {"gradient": "smoothed"},
    "gradient: spectral": {"gradient": "spectral"},
    "smoothness: mean (Eq. 2)": {"smoothness": "mean"},
    "smoothness: sum (Eq. 2)": {"smoothness": "sum"},
    "paper, as printed": {**PAPER, "density_weight": "printed", "gradient": "spectral"},
    "paper, weight intended": {**PAPER, "gradient": "spectral"},
    "paper, smoothed gradient": {**PAPER, "gradient": "smoothed"},
}


def scores(prior: DamagedPrior) -> Iterator[tuple[str, np.ndarray]]:
    """Name and score of each variant, the plain neighbour count first."""
    yield "plain neighbour count", neighbour_baseline(prior)
    for name, options in VARIANTS.items():
        scored = score_quality(
            prior.surface.samples,
            prior.scene.cloud,
            thinned=prior.surface.thinned,
            settings=QualitySettings(**options),
        )
        yield name, scored.quality


def measure(scene: Scene, seeds: int) -> dict[str, np.ndarray]:
    """Areas of each variant: holes, patches, thinned, noisy, one row a seed."""
    scale = derive_scale(scene, camera_of(CameraSettings()), ScaleSettings())
    depth = scale.poisson_depth
    intact = reconstruct_surface(scene, radius=scale.radius, poisson_depth=depth)
    areas: dict[str, list[tuple[float, ...]]] = {}
    for seed in range(seeds):
        prior = damage_prior(scene, intact, poisson_depth=depth, seed=seed)
        for name, score in scores(prior):
            areas.setdefault(name, []).append(astuple(detection(prior, score)))
    return {name: np.array(rows) for name, rows in areas.items()}


def table(name: str, areas: dict[str, np.ndarray]) -> str:
    """Markdown table of one scene: mean over the seeds, and the worst seed of holes and patches."""
    lines = [
        f"\n### {name}\n",
        "| variant | holes | (worst) | patches | (worst) | thinned | noisy |",
        "|---|---|---|---|---|---|---|",
    ]
    for variant, rows in areas.items():
        mean, worst = rows.mean(axis=0), rows.min(axis=0)
        lines.append(
            f"| {variant} | {mean[0]:.3f} | {worst[0]:.3f} | {mean[1]:.3f} | {worst[1]:.3f} "
            f"| {mean[2]:.3f} | {mean[3]:.3f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure every scene and print the tables as they are ready."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clouds", type=Path, help="folder of the point clouds")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--scenes", nargs="+", default=[*CHOSEN, *HELD_OUT])
    options = parser.parse_args()
    for name in options.scenes:
        synthetic = name == "synthetic"
        scene = synthetic_scene(0) if synthetic else load_scene(options.clouds / name)
        print(table(name, measure(scene, options.seeds)), flush=True)


if __name__ == "__main__":
    main()
