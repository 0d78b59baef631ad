"""Flights through made-up blocks, measured by distances that the planner does not use."""

import numpy as np
import pytest

from planner.airspace import airspace as airspaces
from planner.airspace.airspace import build_airspace
from planner.config import FlightSettings, RouteSettings
from planner.flight.fly import plan_flight
from planner.flight.limits import Limits
from planner.flight.sampling import sample_path
from planner.flight.timing import fly_in_time
from planner.route.order import order_viewpoints
from planner.route.ways import FreeWays
from planner.scene.synthetic import scene_of, synthetic_block
from planner.viewpoints.viewpoints import Viewpoints

COUNT = 50
SPACING = 0.02


def free_viewpoints(airspace, seed):
    """Random free poses near solids."""
    rng = np.random.default_rng(seed)
    found = np.zeros((0, 3))
    while len(found) < COUNT:
        spots = rng.uniform(*airspace.bounds, (400, 3))
        spots = spots[airspace.is_free(spots)]
        found = np.concatenate([found, spots[airspace.clearance(spots) < 4 * airspace.d_min]])
    return Viewpoints(
        found[:COUNT],
        rng.uniform(-179, 180, COUNT),
        rng.uniform(-90, 0, COUNT),
        ("cover",) * COUNT,
        np.full(COUNT, -1),
    )


def curve_points(controls):
    """Points at most ``SPACING`` apart on all pieces, by the Bernstein polynomials."""
    found = [np.zeros((0, 3))]
    for a, b, c, d in controls:
        length = sum(np.linalg.norm(step) for step in (b - a, c - b, d - c))
        t = np.linspace(0, 1, 3 * int(length / SPACING) + 2)[:, None]
        found.append(
            (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d
        )
    return np.concatenate(found)


def distance_to_truth(block, points):
    """Distance to the true triangles by Embree and to the raw points by a k-d tree."""
    import open3d as o3d
    from scipy.spatial import KDTree

    middle = points.mean(axis=0)  # single precision is finest around zero
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(
        o3d.core.Tensor((block.mesh.vertices - middle).astype(np.float32)),
        o3d.core.Tensor(block.mesh.triangles.astype(np.uint32)),
    )
    query = o3d.core.Tensor((points - middle).astype(np.float32))
    to_mesh = scene.compute_distance(query, nthreads=1).numpy()
    return np.minimum(to_mesh, KDTree(block.cloud.xyz).query(points)[0])


def winding_number(vertices, triangles, points):
    """How often the triangles wind around each point: about 1 inside of a closed solid."""
    total = np.zeros(len(points))
    for row, point in enumerate(points):
        a, b, c = (vertices[triangles[:, k]] - point for k in range(3))
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        total[row] = 2.0 * np.arctan2(volume, below).sum() / (4 * np.pi)
    return total


def fly_block(seed, d_min=2.0):
    """Plan a flight through a block; return what was found and assert that all of it is safe."""
    block = synthetic_block(seed, spacing=0.7)
    scene = scene_of(block)
    airspace = build_airspace(scene, block.mesh, d_min=d_min, d_max=10 * d_min)
    views = free_viewpoints(airspace, seed)
    ways = FreeWays(airspace, margin=FlightSettings().margin)
    route = order_viewpoints(views, settings=RouteSettings(), box=scene.box, seed=seed, ways=ways)
    flight = plan_flight(views.take(route.order), airspace, seed=seed, ways=ways)

    rows = sample_path(fly_in_time(flight.path, flight.viewpoints, Limits()), d_min=d_min)
    for points in (curve_points(flight.path.controls), rows[:, 1:4]):
        assert distance_to_truth(block, points).min() >= d_min
    assert_outside(block, flight.viewpoints.positions)
    return {
        "viewpoints": COUNT,
        "dropped": COUNT - len(flight.kept),
        "legs": len(flight.kept) - 1,
        "repaired": len(flight.repaired),
        "corners": len(flight.path.corners()),
    }


def assert_outside(block, spots):
    closed = block.mesh.triangles[block.parts > 0]
    assert (winding_number(block.mesh.vertices, closed, spots) < 0.5).all()
    assert (spots[:, 2] > block.ground.height(spots)).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_no_point_of_a_flight_through_a_block_is_too_close(seed):
    found = fly_block(seed)
    assert found["dropped"] <= 2


def fly_inside(seed):
    """Ask for places deep inside of solids; return how many there were."""
    block = synthetic_block(seed, spacing=0.7)
    airspace = build_airspace(scene_of(block), block.mesh, d_min=2.0, d_max=20.0)
    spots = np.random.default_rng(seed).uniform(*airspace.bounds, (2000, 3))
    shell = distance_to_truth(block, spots)
    closed = block.mesh.triangles[block.parts > 0]
    deep = spots[shell > 2.5]
    deep = deep[winding_number(block.mesh.vertices, closed, deep) > 0.5][:6]
    views = Viewpoints(
        deep, np.zeros(len(deep)), np.zeros(len(deep)), ("",) * len(deep), np.zeros(len(deep))
    )
    settings = FlightSettings(iterations=50)
    flight = plan_flight(views, airspace, settings=settings, seed=seed)
    assert_outside(block, flight.viewpoints.positions)
    return len(deep)


@pytest.mark.slow
def test_a_broken_sign_is_noticed_in_a_block(monkeypatch):
    assert fly_inside(0) >= 1
    signed = airspaces.Airspace.clearance
    monkeypatch.setattr(
        airspaces.Airspace, "clearance", lambda self, points: np.abs(signed(self, points))
    )
    with pytest.raises(AssertionError):
        fly_inside(0)


@pytest.mark.slow
def test_a_lost_ground_is_noticed_in_a_block(monkeypatch):
    fly_without_ground(0)
    whole = airspaces.terrain
    monkeypatch.setattr(airspaces, "terrain", lambda ground: lowered(whole(ground)))
    with pytest.raises(AssertionError):
        fly_without_ground(0)


def lowered(sheet):
    return type(sheet)(sheet.corners - 50.0, sheet.origin, sheet.cell)


def fly_without_ground(seed):
    """The same among the solids alone, so that only the terrain sheet keeps flights up."""
    block = synthetic_block(seed, spacing=0.7)
    scene = scene_of(block)
    solids = type(block.mesh)(block.mesh.vertices, block.mesh.triangles[block.parts > 0])
    high = scene.cloud.take(scene.cloud.classes == 6)
    bare = type(scene)(scene.name, high, None, scene.ground, scene.box, scene.frame)
    space = build_airspace(bare, solids, d_min=2.0, d_max=20.0)
    views = free_viewpoints(space, seed)
    flight = plan_flight(views, space, seed=seed)
    points = curve_points(flight.path.controls)
    assert (points[:, 2] >= block.ground.height(points) + 1.0).all()
