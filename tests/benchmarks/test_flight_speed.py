"""A plan of 250 viewpoints in a dense block, and its certificate: ``--benchmark-only -s``."""

import importlib.util
import time
from pathlib import Path

import pytest

_SOURCE = Path(__file__).parents[1] / "planner" / "test_flight_dense.py"


@pytest.fixture(scope="module")
def dense():
    spec = importlib.util.spec_from_file_location("flight_dense", _SOURCE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seed", [1, 4])
def test_flight_stage_in_a_dense_block(benchmark, dense, seed):
    from planner.config import FlightSettings, RouteSettings
    from planner.flight.fly import plan_flight
    from planner.route.order import order_viewpoints
    from planner.route.ways import FreeWays

    space, box, views = dense.dense_block(seed, 250)
    dense.fly(space, box, views.take(range(20)))  # loads and compiles
    ways = FreeWays(space, margin=FlightSettings().margin)
    start = time.perf_counter()
    route = order_viewpoints(views, settings=RouteSettings(), box=box, seed=0, ways=ways)
    ordered = time.perf_counter() - start
    views = views.take(route.order)

    def fly():  # ways are known from the order only to a plan; here the stage finds them itself
        return plan_flight(views, space, seed=0)

    start = time.process_time()
    flight = benchmark.pedantic(fly, rounds=1)
    processor = time.process_time() - start
    figures = {
        "triangles": len(space.mesh),
        "legs blocked": route.blocked / (len(views) - 1),
        "order, s": ordered,
        "flight, s of processor": processor,
        "kept": len(flight.kept),
        "length / free ways": flight.path.length / route.way_length,
    }
    _say(benchmark, figures)
    assert figures["legs blocked"] >= 0.3
    assert figures["length / free ways"] <= 1.15


def test_certificate_over_two_hundred_thousand_triangles(benchmark, dense):
    from planner.flight.certificate import certify

    space, box, views = dense.dense_block(1, 250, triangles=120_000)
    _, flight = dense.fly(space, box, views)
    start = time.process_time()
    proof = benchmark.pedantic(certify, (flight.path.controls, space), rounds=1)
    processor = time.process_time() - start
    gap = dense.least_clearances(space, flight.path.controls) - proof.clearance
    figures = {
        "triangles": len(space.mesh),
        "pieces": len(flight.path),
        "s of processor": processor,
        "mean under the truth, share of d_min": gap.mean() / space.d_min,
        "most": gap.max() / space.d_min,
    }
    _say(benchmark, figures)
    assert proof.safe.all()
    assert gap.min() >= 0.0
    assert figures["mean under the truth, share of d_min"] <= 0.1


def _say(benchmark, figures):
    benchmark.extra_info.update(figures)
    for name, value in figures.items():
        print(f"{name}: {value:.4g}", flush=True)
