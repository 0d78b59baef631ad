"""Flights low between the buildings of a dense block, where the next photo is often hidden."""

import numpy as np
import pytest

from planner.airspace.airspace import build_airspace
from planner.config import FlightSettings, RouteSettings
from planner.flight.certificate import certify
from planner.flight.fly import plan_flight
from planner.geometry import bezier
from planner.route.order import order_viewpoints
from planner.route.ways import FreeWays
from planner.scene.cloud import Mesh
from planner.scene.synthetic import scene_of, synthetic_block
from planner.viewpoints.viewpoints import Viewpoints


def halved(mesh):
    """The same surface with four times as many triangles."""
    corners = mesh.vertices[mesh.triangles]
    middle = 0.5 * (corners + np.roll(corners, -1, axis=1))
    a, b, c = (corners[:, k] for k in range(3))
    ab, bc, ca = (middle[:, k] for k in range(3))
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    soup = np.concatenate([np.stack(part, axis=1) for part in parts])
    return Mesh(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3))


def dense_block(seed, count, *, d_min=1.5, triangles=0, top=20.0):
    """Airspace, box and viewpoints near facades, below most roofs."""
    block = synthetic_block(seed, spacing=0.7, buildings=30, heights=(20.0, 40.0))
    mesh, scene = block.mesh, scene_of(block)
    while len(mesh) < triangles:
        mesh = halved(mesh)
    space = build_airspace(scene, mesh, d_min=d_min, d_max=10 * d_min)
    rng = np.random.default_rng(seed)
    low, high = space.low + [15, 15, 0], np.r_[space.high[:2] - 15, top]
    spots = np.zeros((0, 3))
    while len(spots) < count:
        tried = rng.uniform(low, high, (2000, 3))
        tried = tried[space.is_free(tried)]
        spots = np.concatenate([spots, tried[space.clearance(tried) < 2 * d_min]])
    views = Viewpoints(
        spots[:count],
        rng.uniform(-179, 180, count),
        rng.uniform(-90, 0, count),
        ("cover",) * count,
        np.full(count, -1),
    )
    return space, scene.box, views.rounded()


def fly(space, box, views, **route_settings):
    """Order and flight as a plan makes them."""
    ways = FreeWays(space, margin=FlightSettings().margin)
    settings = RouteSettings(**route_settings)
    route = order_viewpoints(views, settings=settings, box=box, seed=0, ways=ways)
    return route, plan_flight(views.take(route.order), space, seed=0, ways=ways)


def least_clearances(space, controls, step=0.02):
    """Smallest clearance met on each piece at points so far apart, (M,), metres."""
    found = []
    for piece in controls:
        count = int(bezier.lengths(piece[None])[0] / step) + 2
        points = bezier.evaluate(np.repeat(piece[None], count, axis=0), np.linspace(0, 1, count))
        found.append(space.clearance_range(points)[0].min())
    return np.array(found)


@pytest.mark.slow
def test_a_flight_through_a_dense_block_is_hardly_longer_than_the_free_ways():
    space, box, views = dense_block(1, 100)
    route, flight = fly(space, box, views)
    assert route.blocked >= 0.3 * (len(views) - 1)
    assert len(flight.kept) == len(views)
    assert flight.path.length <= 1.15 * route.way_length

    truth = least_clearances(space, flight.path.controls)
    proof = certify(flight.path.controls, space)
    assert proof.safe.all()
    assert truth.min() >= space.d_min
    assert (proof.clearance <= truth).all()
    assert (truth - proof.clearance).mean() <= 0.1 * space.d_min
