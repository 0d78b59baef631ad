"""Many made-up blocks through order, curve and repair: run with ``--benchmark-only``.

``SCANWRIGHT_BLOCKS`` is the number of blocks (200 unless set); their seeds count up from 1000.
"""

import importlib.util
import os
from pathlib import Path

_SOURCE = Path(__file__).parents[1] / "planner" / "test_flight_blocks.py"


def test_no_flight_through_any_block_is_too_close(benchmark):
    spec = importlib.util.spec_from_file_location("flight_blocks", _SOURCE)
    blocks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(blocks)
    seeds = range(1000, 1000 + int(os.environ.get("SCANWRIGHT_BLOCKS", "200")))
    found = benchmark.pedantic(lambda: [blocks.fly_block(seed) for seed in seeds], rounds=1)
    total = {key: sum(one[key] for one in found) for key in found[0]}
    for name, share in (
        ("kept", 1.0 - total["dropped"] / total["viewpoints"]),
        ("repaired", total["repaired"] / total["legs"]),
        ("corners", total["corners"] / total["legs"]),
    ):
        benchmark.extra_info[name] = share
        print(f"{name}: {100 * share:.2f} %")
    print(f"{len(seeds)} blocks, {total['legs']} legs: no point closer than d_min")
    assert total["dropped"] <= 0.005 * total["viewpoints"]
