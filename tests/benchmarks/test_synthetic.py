"""How fast a made-up block appears: mesh alone, cheap cloud, default cloud, a large place."""

import pytest

from planner.scene.synthetic import scene_of, synthetic_block

PLACES = {
    "default": {},
    "towers": {"size": (60.0, 85.0), "heights": (5.0, 25.0)},
    "large": {"size": (190.0, 270.0), "buildings": 90, "spacing": 0.5},
}


@pytest.mark.parametrize("place", PLACES)
def test_mesh(benchmark, place):
    options = PLACES[place] | {"spacing": None}
    assert len(benchmark(synthetic_block, 1, **options).mesh) > 1000


def test_cheap_cloud(benchmark):
    assert len(benchmark(synthetic_block, 1, spacing=1.0).cloud) > 3000


@pytest.mark.parametrize("place", PLACES)
def test_cloud(benchmark, place):
    block = benchmark.pedantic(synthetic_block, (1,), PLACES[place], rounds=3, warmup_rounds=1)
    assert len(block.cloud) > 50_000


def test_scene_of_the_default_block(benchmark):
    block = synthetic_block(1)
    assert benchmark.pedantic(scene_of, (block,), rounds=3, warmup_rounds=1).metric
