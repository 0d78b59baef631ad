"""Few photos in little time on the benchmark block: run with ``--benchmark-only``.

The target is that of the literature, h of at least 3 on 97.8 % of the samples in reach, without
the wish for sharp photos, without a floor for the rest and without bridges. The literature counts
the samples that photos were chosen by, so nothing guards these; ``guarded`` is the same with
guards. ``SCANWRIGHT_EFFORTS`` names the efforts to run (``quick`` unless set); ``best`` takes two
minutes on one core.
"""

import os
import resource
import time

import pytest

from planner.config import ViewpointSettings
from planner.evaluation.place import prepare
from planner.scene.benchmark import benchmark_block, benchmark_config
from planner.viewpoints.select import select_viewpoints

EFFORTS = os.environ.get("SCANWRIGHT_EFFORTS", "quick").split(",")
MOST = {"quick": 240, "standard": 220, "best": 205}
LITERATURE = {"target": 3.0, "share": 0.978, "floor": 0.0, "sharp_views": 0, "connected": False}
WISHES = {"literature": LITERATURE, "guarded": LITERATURE, "default": {}}


def choose(place, seed=0, guarded=True, **options):
    settings = ViewpointSettings(objective="reconstructability", **options)
    lengths = {name: getattr(place.scale, name) for name in ("d_min", "d_max", "gsd")}
    return select_viewpoints(
        *(place.positions, place.surface.mesh, place.samples, place.camera),
        settings=settings,
        voxel=place.voxel,
        seed=seed,
        airspace=place.airspace,
        guards=place.guards if guarded else None,
        **lengths,
    )


@pytest.fixture(scope="module")
def place():
    place = prepare(benchmark_block(), benchmark_config())
    choose(place, effort="quick", iterations=3)  # compiles
    return place


@pytest.mark.parametrize("wish", WISHES)
@pytest.mark.parametrize("effort", EFFORTS)
def test_views(benchmark, place, effort, wish):
    options = {"effort": effort, "guarded": wish != "literature", **WISHES[wish]}
    selection = benchmark.pedantic(choose, (place,), options, rounds=1)
    share, views = selection.reconstructable(3.0), len(selection.viewpoints)
    benchmark.extra_info.update(views=views, share=share, bound=selection.results[-1].bound)
    print(f"{effort}, {wish}: {views} views, h >= 3 on {100 * share:.2f} %")
    assert share >= 0.978
    assert wish != "literature" or views <= MOST[effort]
    if wish == "default":
        assert selection.graph.components == 1


@pytest.mark.parametrize("seed", range(1, 4))
def test_seeds(benchmark, place, seed):
    options = {"effort": "quick", "guarded": False, **LITERATURE}
    selection = benchmark.pedantic(choose, (place, seed), options, rounds=1)
    benchmark.extra_info["views"] = len(selection.viewpoints)
    print(f"seed {seed}: {len(selection.viewpoints)} views")
    assert len(selection.viewpoints) <= MOST["quick"]


def test_ten_times_the_area(benchmark, place):
    large = prepare(benchmark_block(size=(190.0, 270.0)), benchmark_config())
    start = time.process_time()
    choose(place, effort="quick")
    once = time.process_time() - start
    start = time.process_time()
    selection = benchmark.pedantic(choose, (large,), {"effort": "quick"}, rounds=1)
    times = (time.process_time() - start) / once
    gigabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    benchmark.extra_info.update(times=times, gigabytes=gigabytes)
    print(f"{len(large.samples)} samples: {len(selection.viewpoints)} views, ", end="")
    print(f"{times:.1f} times the time, {gigabytes:.1f} GB")
    assert gigabytes <= 8.0
    assert times <= 15.0
