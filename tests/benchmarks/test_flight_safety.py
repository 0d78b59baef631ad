"""Many made-up blocks through order, curve and repair: run with ``--benchmark-only -s``.

``SCANWRIGHT_BLOCKS`` is the number of blocks (200 unless set); their seeds count up from 1000,
or from ``SCANWRIGHT_FIRST_BLOCK``.
"""

import importlib.util
import os
import traceback
from pathlib import Path

_SOURCE = Path(__file__).parents[1] / "planner" / "test_flight_blocks.py"


def test_no_flight_through_any_block_is_too_close(benchmark):
    spec = importlib.util.spec_from_file_location("flight_blocks", _SOURCE)
    blocks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(blocks)
    first = int(os.environ.get("SCANWRIGHT_FIRST_BLOCK", "1000"))
    seeds = range(first, first + int(os.environ.get("SCANWRIGHT_BLOCKS", "200")))
    found = benchmark.pedantic(lambda: fly_all(blocks, seeds), rounds=1)
    benchmark.extra_info.update(found)
    assert found["violations"] == found["crashes"] == 0
    assert found["dropped"] <= 0.005 * found["viewpoints"]


def fly_all(blocks, seeds):
    """Totals over all blocks; prints them every ten, so that a broken run tells something too."""
    total = dict.fromkeys(("blocks", "violations", "crashes", "viewpoints", "dropped", "legs"), 0)
    for seed in seeds:
        total["blocks"] += 1
        try:
            for key, value in blocks.fly_block(seed).items():
                total[key] = total.get(key, 0) + value
        except AssertionError:
            total["violations"] += 1
            print(f"seed {seed} is too close:\n{traceback.format_exc()}", flush=True)
        except Exception:
            total["crashes"] += 1
            print(f"seed {seed} crashed:\n{traceback.format_exc()}", flush=True)
        if total["blocks"] % 10 == 0 or seed == seeds[-1]:
            print(f"seeds {seeds[0]} to {seed}: {total}", flush=True)
    return total
