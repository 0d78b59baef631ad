"""How good the photos of each preset are: the tables of docs/views.md.

Run it from the repository's root; the argument is a folder of scenes:

    python docs/comparisons/views.py MESHES > table.md
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner.attempts import Prior
from planner.config import Config
from planner.evaluation.place import coarser, prepare
from planner.evaluation.views import Trial, ViewMeasures, measure_views, trial
from planner.scene.benchmark import benchmark_block, benchmark_config
from planner.scene.load import load_scene
from planner.viewpoints.select import select_viewpoints
from planner.viewpoints.selection import Selection

BENCHMARK = "benchmark block"
SCENES = (
    BENCHMARK,
    "lyon_church_vaulx.ply",
    "3dbag_thehague_block.ply",
    "rotterdam_block_220m.ply",
)
PAIRS = {"preset": "cover", "objective": "reconstructability"}
PRESETS: dict[str, dict[str, Any]] = {
    "smith": {"preset": "smith"},
    "paper low": {"preset": "paper"},
    "paper high": {"preset": "paper"},
    "cover (hits)": {"preset": "cover", "objective": "hits"},
    "quick": {**PAIRS, "effort": "quick"},
    "standard": {**PAIRS, "effort": "standard"},
    "best": {**PAIRS, "effort": "best"},
}
LOW = 4.0 / 3.0  # R of ``paper low`` over that of ``paper high``, which is 1.5 % of the scene
HEAD = (
    "| preset | views | h≥3 | h≥4 | h≥3 planned | h≥3 noise | h≥4 noise | matchable "
    "| GSD | GSD 95 % | nearest | parts | links | tour | bound | gap | seconds |"
)


def load(name: str, folder: Path) -> Prior:
    """The place of one scene, with its settings."""
    if name == BENCHMARK:
        return prepare(benchmark_block(), benchmark_config())
    return prepare(load_scene(folder / name), Config())


def choose(place: Prior, options: dict[str, Any]) -> Selection:
    """Photos of a place by some settings."""
    scale = place.scale
    return select_viewpoints(
        place.positions,
        place.surface.mesh,
        place.samples,
        place.camera,
        settings=place.config.viewpoints.model_validate(options),
        d_min=scale.d_min,
        d_max=scale.d_max,
        gsd=scale.gsd,
        voxel=place.voxel,
        seed=place.config.seed,
        airspace=place.airspace,
        guards=place.guards,
    )


def warm_up(place: Prior, options: dict[str, Any]) -> None:
    """Compile what a preset needs, on a few positions, so that it is not timed."""
    choose(replace(place, positions=place.positions[::40]), {**options, "views": 6, "rounds": 1})


def measure(case: Trial, preset: str, options: dict[str, Any]) -> ViewMeasures:
    """Choose photos by one preset and measure them."""
    place = coarser(case.place, LOW) if preset == "paper low" else case.place
    warm_up(place, options)
    start = time.process_time()
    selection = choose(place, options)
    return measure_views(case, selection, seconds=time.process_time() - start)


def sizes(case: Trial) -> str:
    """How many samples there are, and how many of them any photos could reconstruct."""
    return " and ".join(
        f"{len(flags)} {kind} ({100.0 * flags.mean():.1f} % reachable)"
        for kind, flags in (
            ("samples to plan by", case.reachable),
            ("fresh ones to judge by", case.fresh_reachable),
        )
    )


def row(preset: str, m: ViewMeasures) -> str:
    """One line of the table."""
    shares = (m.share, m.better, m.planned, m.noisy, m.noisy_better, m.matchable)
    cells = [
        preset,
        str(m.views),
        *(f"{100.0 * share:.1f} %" for share in shares),
        *(f"{1000.0 * gsd:.1f} mm" for gsd in (m.gsd, m.coarse_gsd)),
        f"{m.nearest:.1f} m",
        str(m.components),
        str(m.least_degree),
        f"{m.tour:.0f} m",
        f"{m.bound:.1f}",
        f"{100.0 * m.gap:.0f} %",
        f"{m.seconds:.1f}",
    ]
    return "| " + " | ".join(cell.replace("nan %", "").replace("nan", "") for cell in cells) + " |"


def main() -> None:
    """Measure every preset on every scene and print each line as it is ready."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of the scenes")
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    parser.add_argument("--presets", nargs="+", default=PRESETS, choices=PRESETS)
    parser.add_argument("--views", type=int, default=433, help="of smith, on the benchmark block")
    parser.add_argument("--set", nargs="+", default=[], help="for all but the comparators")
    options = parser.parse_args()
    wish = dict(assignment.split("=", 1) for assignment in options.set)
    for name in options.scenes:
        case = trial(load(name, options.folder))
        print(f"\n### {name}\n\n{sizes(case)}\n")
        print(f"{HEAD}\n{'|---' * (HEAD.count('|') - 1)}|", flush=True)
        for preset in options.presets:
            settings = dict(PRESETS[preset])
            if preset == "smith" and name == BENCHMARK:
                settings["views"] = options.views
            if "objective" in settings:
                settings |= wish
            print(row(preset, measure(case, preset, settings)), flush=True)


if __name__ == "__main__":
    main()
