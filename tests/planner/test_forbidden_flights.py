"""Prisms through the middle of a place and ceilings under its roofs: flown right, or refused."""

import numpy as np
import pytest

from planner.airspace.airspace import build_airspace
from planner.config import AirspaceSettings, Config, FlightSettings, RouteSettings, ZoneSettings
from planner.errors import PlannerError
from planner.flight.fly import plan_flight
from planner.planning import plan
from planner.route.order import order_viewpoints
from planner.route.ways import FreeWays
from planner.scene.synthetic import scene_of, synthetic_block

STRIP = ((-3.0, -300.0), (3.0, -300.0), (3.0, 300.0), (-3.0, 300.0))


@pytest.fixture(scope="module")
def block():
    return synthetic_block(
        3,
        size=(44.0, 44.0),
        buildings=3,
        heights=(9.0, 14.0),
        spacing=1.2,
        trees=False,
        bridge=False,
        relief=0.0,
        turn=0.0,
    )


def fly(block, viewpoints_at, *, count=24, **settings):
    """Photos at random free places, in the order of a plan."""
    scene = scene_of(block)
    space = build_airspace(
        scene, block.mesh, d_min=2.0, d_max=15.0, settings=AirspaceSettings(**settings)
    )
    rng = np.random.default_rng(0)
    spots = np.round(rng.uniform(*space.bounds, (6000, 3)), 4)
    spots = spots[(space.clearance(spots) >= 2.01) & (space.zone_margin(spots) >= 0.01)]
    views = viewpoints_at(spots[space.clearance(spots) < 6.0][:count])
    ways = FreeWays(space, margin=FlightSettings().margin)
    route = order_viewpoints(views, settings=RouteSettings(), box=scene.box, seed=0, ways=ways)
    flight = plan_flight(
        views.take(route.order), space, settings=FlightSettings(iterations=2000), ways=ways
    )
    return space, route, flight


def assert_clear_of_truth(block, points):
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(
        o3d.core.Tensor(block.mesh.vertices.astype(np.float32)),
        o3d.core.Tensor(block.mesh.triangles.astype(np.uint32)),
    )
    query = o3d.core.Tensor(points.astype(np.float32))
    assert scene.compute_distance(query, nthreads=1).numpy().min() >= 2.0


@pytest.mark.slow
def test_a_prism_without_an_end_parts_the_place_in_two(block, viewpoints_at, dense_points):
    strip = ZoneSettings(polygon=STRIP, name="railway")
    _, route, flight = fly(block, viewpoints_at, zones=(strip,))
    sides = np.sign(flight.viewpoints.positions[:, 0])
    assert len(set(sides.tolist())) == 1  # the larger part is flown
    assert [finding.code for finding in route.findings] == ["separate-space"]
    assert len(flight.kept) == (route.spaces == 0).sum()
    assert route.findings[0].number == (route.spaces == 1).sum() > 0
    points = dense_points(flight.path)
    assert np.abs(points[:, 0]).min() >= 3.0
    assert_clear_of_truth(block, points)


@pytest.mark.slow
def test_a_prism_with_a_top_is_flown_over(block, viewpoints_at, dense_points):
    strip = ZoneSettings(polygon=STRIP, top=18.0, name="railway")
    _, route, flight = fly(block, viewpoints_at, zones=(strip,))
    assert len(flight.kept) == 24
    assert len(set(np.sign(flight.viewpoints.positions[:, 0]).tolist())) == 2
    assert route.findings == ()
    points = dense_points(flight.path)
    across = points[np.abs(points[:, 0]) < 3.0]
    assert len(across) > 0
    assert across[:, 2].min() >= 18.0
    assert_clear_of_truth(block, points)


def test_under_a_ceiling_lower_than_the_roofs_ways_lead_around_the_houses(
    block, viewpoints_at, dense_points
):
    assert block.mesh.vertices[:, 2].max() > 9.0
    space, route, flight = fly(block, viewpoints_at, count=70, ceiling=7.0)
    assert len(flight.kept) == 70
    assert route.blocked > 0
    points = dense_points(flight.path)
    assert (points[:, 2] <= space.ground.height(points) + 7.0).all()
    assert_clear_of_truth(block, points)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"ceiling": 1.0},
            r"airspace\.ceiling = 1: is under d_min 2 m.*; raise it by over 1\.00 m",
        ),
        (
            {"zones": [{"kind": "keep_in", "polygon": [(900, 0), (990, 0), (990, 90)]}]},
            r"lies 8\d\d\.\d m away from the scene",
        ),
        ({"zones": [{"polygon": [(-900, -900), (900, -900), (0, 1900)]}]}, r"lacks \d+\.\d\d m"),
    ],
)
def test_where_nothing_is_free_the_plan_is_refused_with_the_number_that_is_missing(
    block, settings, message
):
    config = Config.model_validate(
        {"airspace": settings, "scale": {"d_min": 2.0, "d_max": 15.0, "radius": 1.5}}
    )
    with pytest.raises(PlannerError, match=message) as refusal:
        plan(scene_of(block), config)
    assert "\n" not in str(refusal.value)
