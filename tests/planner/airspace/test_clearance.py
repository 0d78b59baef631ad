"""Signed clearance and what is free, on places small enough to work out by hand."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.airspace.airspace import build_airspace
from planner.airspace.terrain import terrain
from planner.config import AirspaceSettings
from planner.scene.cloud import Mesh
from planner.scene.scene import Ground

UP = np.array([0.0, 0.0, 1.0])
UNIT = [((0, 0, 5), (1, 1, 6))]


def built(make, mesh, *, d_min=3.0, points=(), settings=None, **place):
    return build_airspace(
        make.scene(points, **place),
        mesh,
        d_min=d_min,
        d_max=15.0,
        settings=settings or AirspaceSettings(),
    )


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((2, 0.5, 5.5), 1.0),  # beside a face
        ((2, 2, 5.5), np.sqrt(2)),  # beside an upright edge
        ((2, 2, 7), np.sqrt(3)),  # off a corner
        ((0.5, 0.5, 8), 2.0),  # above
        ((0.5, 0.5, 4.8), 0.2),  # under: it hangs in the air
        ((1.001, 0.5, 5.5), 0.001),
        ((0.5, 0.5, 5.5), -0.5),  # centre
        ((0.9, 0.5, 5.5), -0.1),
        ((10, 10, 2), 2.0),  # above the ground
        ((10, 10, -1), -1.0),  # under it
        ((33, -12, 7), 7.0),  # beyond the ground's rim it goes on level
        ((33, -12, -3), -3.0),
        ((np.nan, 0, 9), -np.inf),
    ],
)
def test_a_unit_box_has_the_distances_worked_out_by_hand(make, point, expected):
    airspace = built(make, make.boxes(UNIT), d_min=1.0)
    np.testing.assert_allclose(airspace.clearance(np.array([point])), [expected], atol=1e-12)


boxes = st.lists(
    st.tuples(st.tuples(*[st.integers(-9, 9)] * 2), st.tuples(*[st.integers(2, 9)] * 3)),
    min_size=1,
    max_size=5,
)


@settings(max_examples=15, deadline=None)
@given(boxes, st.integers(0, 2**31), st.booleans())
def test_random_blocks_have_exactly_the_closed_form_clearance(make, solids, sizes, seed, flipped):
    """Whatever the orientation of the faces; buried faces only deepen what is inside."""
    blocks = [((x, y, 0), (x + w, y + d, h)) for (x, y), (w, d, h) in sizes]
    rng = np.random.default_rng(seed)
    mesh = make.boxes(blocks)
    if flipped:
        turned = rng.random(len(mesh)) < 0.5
        mesh = Mesh(
            mesh.vertices, np.where(turned[:, None], mesh.triangles[:, ::-1], mesh.triangles)
        )
    airspace = built(make, mesh, d_min=1.5)
    points = rng.uniform((-25, -25, -2), (25, 25, 22), (300, 3))
    truth, got = solids(blocks, ground=0.0).clearance(points), airspace.clearance(points)
    assert (got <= np.maximum(truth, 0.0) + 1e-9).all()
    outside = truth > 0.4 * airspace.d_min  # a gap narrower than 0.75 d_min may count as inside
    np.testing.assert_allclose(got[outside], truth[outside], atol=1e-9)
    low, high = airspace.clearance_range(points)
    assert ((low <= got + 1e-9) & (got <= high + 1e-9)).all()  # each by its own arithmetic
    np.testing.assert_array_equal(low[truth >= 1.5], high[truth >= 1.5])


def test_under_a_bridge_is_free_where_there_is_room(make):
    deck = make.boxes([((-20, -4, 10), (20, 4, 11))])
    heights = np.arange(0.25, 10.0, 0.5)
    under = np.column_stack([np.zeros((len(heights), 2)), heights])
    free = built(make, deck).is_free(under)
    np.testing.assert_array_equal(free, (heights >= 3.0) & (heights <= 7.0))
    low = make.boxes([((-20, -4, 5), (20, 4, 6))])
    assert not built(make, low).is_free(under[heights < 5]).any()


def test_a_bridge_thinner_than_a_cell_stays_open_below(make):
    deck = make.boxes([((-20, -4, 10), (20, 4, 10.01))])
    airspace = built(make, deck)
    assert airspace.edge_is_free(np.array([0, -15, 5.0]), np.array([0, 15, 5.0]))


def test_a_courtyard_is_open_and_as_free_as_it_is_wide(make):
    def yard(half):
        walls = [
            ((-half - 4, -half - 4, 0), (half + 4, -half, 12)),
            ((-half - 4, half, 0), (half + 4, half + 4, 12)),
            ((-half - 4, -half, 0), (-half, half, 12)),
            ((half, -half, 0), (half + 4, half, 12)),
        ]
        return built(make, make.boxes(walls))

    wide, narrow = yard(6.0), yard(2.0)
    at = np.array([[0, 0, 5.0], [2.9, 2.9, 3.1], [3.1, 0, 5], [0, 0, 2.9]])
    np.testing.assert_array_equal(wide.is_free(at), [True, True, False, False])
    assert not narrow.is_free(np.array([[0, 0, z] for z in np.arange(0.0, 13)])).any()
    np.testing.assert_allclose(narrow.clearance(np.array([[0, 0, 6.0]])), [2.0])


def test_a_hollow_shell_is_solid(make):
    airspace = built(make, make.boxes([((-10, -10, 0), (10, 10, 18))]))
    inside = np.array([[0, 0, 9.0], [5, 5, 5], [0, 0, 4]])
    assert (airspace.clearance(inside) < 0).all()
    assert not airspace.is_free(inside).any()
    assert not airspace.edge_is_free(inside[0], inside[1])


@pytest.mark.parametrize(("gap", "closed"), [(0.7, True), (1.6, True), (7.0, False)])
def test_a_hole_in_a_wall_counts_only_when_one_could_fly_through(make, gap, closed):
    """Cells are 0.75 m and thickened by one; a drone that keeps 3 m needs a hole of 6 m."""
    shell = make.boxes([((-10, -10, 0), (10, 10, 18))])
    wall = (shell.vertices[shell.triangles][:, :, 0] == 10).all(axis=1)
    frame = make.boxes(
        [
            ((10, -10, 0), (10.01, -gap / 2, 18)),
            ((10, gap / 2, 0), (10.01, 10, 18)),
            ((10, -gap / 2, 0), (10.01, gap / 2, 9 - gap / 2)),
            ((10, -gap / 2, 9 + gap / 2), (10.01, gap / 2, 18)),
        ]
    )
    soup = make.join(Mesh(shell.vertices, shell.triangles[~wall]), frame)
    airspace = built(make, soup, settings=AirspaceSettings(fill_under_roofs=False))
    assert (airspace.clearance(np.array([[0, 0, 9.0]]))[0] < 0) == closed
    inside, out = np.array([5.0, 0, 9]), np.array([15.0, 0, 9])
    assert airspace.edge_is_free(inside, out) == (not closed)
    assert not airspace.edge_is_free(inside + 4 * UP, out + 4 * UP)


@pytest.mark.parametrize("fill", [True, False])
def test_a_roof_without_walls_is_a_building_unless_told_otherwise(make, fill):
    roof = make.sheet((-8, -8), (8, 8), 14.0)
    airspace = built(make, roof, settings=AirspaceSettings(fill_under_roofs=fill))
    under = np.array([[0, 0, 7.0], [4.9, 0, 7], [-4, 4, 5]])
    assert airspace.is_free(under).tolist() == [not fill] * 3
    across = np.array([-15, 0, 7.0]), np.array([15, 0, 7.0])
    assert airspace.edge_is_free(*across) == (not fill)
    assert airspace.edge_is_free(*(end + 10.1 * UP for end in across))
    beside = airspace.clearance(np.array([[12.0, 0, 7]]))[0]
    assert abs(beside - (4.0 if fill else 7.0)) <= 0.5 * airspace.occupancy.cell + 1e-9


def test_an_underside_keeps_the_space_below_a_roof_open(make):
    both = make.join(
        make.sheet((-8, -8), (8, 8), 14.0), make.sheet((-8, -8), (8, 8), 12.0, up=False)
    )
    assert built(make, both).edge_is_free(np.array([-15, 0, 5.0]), np.array([15, 0, 5.0]))


def test_a_building_cut_by_the_edge_of_the_scene_stays_solid(make):
    """Roof and three walls; the fourth lies beyond the data."""
    cut = make.boxes([((-6, -20, 0), (6, -8, 15))])
    open_side = (cut.vertices[cut.triangles][:, :, 1] == -20).all(axis=1)
    airspace = built(make, Mesh(cut.vertices, cut.triangles[~open_side]))
    assert airspace.clearance(np.array([[0, -14.0, 7], [0, -19, 7]])).max() < 0
    assert not airspace.edge_is_free(np.array([0, -30, 7.0]), np.array([0, -13, 7.0]))


def test_lone_points_keep_their_distance(make):
    mast = np.column_stack([np.zeros((60, 2)), np.linspace(0, 15, 60)])
    airspace = built(make, make.boxes([]), points=mast)
    at = np.array([[3.01, 0, 8], [2.99, 0, 8], [0, 0, 18.01], [0, 0, 17.99]])
    np.testing.assert_array_equal(airspace.is_free(at), [True, False, True, False])
    a, b = np.array([-10.0, 3.01, 8]), np.array([10.0, 3.01, 8])
    assert airspace.edge_is_free(a, b)
    assert not airspace.edge_is_free(a - [0, 0.02, 0], b - [0, 0.02, 0])


def test_a_bird_far_away_is_an_obstacle_but_does_not_blur_the_rest(make):
    bird = np.array([[4000.0, -3000, 900]])
    airspace = built(make, make.boxes(UNIT), d_min=1.0, points=bird)
    assert airspace.occupancy.cell == 0.25
    np.testing.assert_allclose(airspace.clearance(bird + 3 * UP), [3.0])
    assert airspace.is_free(np.array([[2.01, 0.5, 5.5]]))[0]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31))
def test_the_terrain_sheet_is_nowhere_below_the_ground_and_all_under_it_is_solid(make, seed):
    rng = np.random.default_rng(seed)
    ground = Ground(rng.normal(0, 3, (6, 9)), np.array([-7.0, 3.0]), 2.5)
    sheet, mesh = terrain(ground), terrain(ground).mesh(np.full(2, -30.0), np.full(2, 40.0))
    points = np.column_stack([rng.uniform(-25, 35, (400, 2)), np.zeros(400)])
    assert (sheet.height(points) >= ground.height(points) - 1e-12).all()
    corners = mesh.vertices[mesh.triangles]
    weights = rng.dirichlet(np.ones(3), len(corners))
    on = (weights[:, :, None] * corners).sum(axis=1)
    np.testing.assert_allclose(sheet.height(on), on[:, 2], atol=1e-9)
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0).all()


@pytest.mark.parametrize("roofs", [True, False])
def test_nothing_under_rough_terrain_is_outside(make, roofs):
    heights = np.random.default_rng(5).uniform(0, 8, (20, 20))
    under_roofs = AirspaceSettings(fill_under_roofs=roofs)
    airspace = built(make, make.boxes([]), heights=heights, d_min=2.0, settings=under_roofs)
    points = np.random.default_rng(6).uniform((-28, -28, -5), (28, 28, 9), (500, 3))
    under = points[:, 2] <= airspace.ground.height(points)
    assert under.sum() > 100
    assert airspace.clearance(points[under]).max() <= 0.0


def test_huge_terrains_are_merged_but_never_lowered():
    heights = np.random.default_rng(1).normal(size=(1300, 700))
    ground = Ground(heights, np.zeros(2), 0.5)
    sheet = terrain(ground)
    assert sheet.corners.size < 300_000
    at = np.random.default_rng(2).uniform(0, (650, 350), (2000, 2))
    assert (sheet.height(at) >= ground.height(at)).all()


def test_flight_is_only_considered_within_the_grown_box(make):
    airspace = built(make, make.boxes(UNIT))
    low, high = airspace.bounds
    np.testing.assert_allclose(low, [-35, -35, -15])
    np.testing.assert_allclose(high, [35, 35, 35])
    at = np.array([[34.9, 0, 20], [35.1, 0, 20], [0, 0, 35.1], [np.inf, 0, 20]])
    np.testing.assert_array_equal(airspace.is_free(at), [True, False, False, False])
    assert not airspace.edge_is_free(at[0], at[1])
    assert not airspace.capsule_clearance_at_least(at[0], np.array([80.0, 0, 20]), 1.0)
    assert not airspace.capsule_clearance_at_least(at[0], np.full(3, np.nan), 1.0)


def test_how_far_beyond_the_scene_one_may_fly_can_be_set(make):
    airspace = built(make, make.boxes(UNIT), settings=AirspaceSettings(beyond=4.0))
    np.testing.assert_allclose(airspace.bounds, [[-24, -24, -4], [24, 24, 24]])


def test_a_grid_that_must_stay_small_is_only_stricter(make, solids):
    blocks = [((-9, -9, 0), (-2, 9, 12)), ((4, -9, 0), (9, 9, 8))]
    coarse = built(make, make.boxes(blocks), d_min=2.0, settings=AirspaceSettings(most_cells=1000))
    assert coarse.occupancy.cell > 2.0
    points = np.random.default_rng(0).uniform((-30, -30, 0), (30, 30, 25), (2000, 3))
    truth, got = solids(blocks, ground=0.0).clearance(points), coarse.clearance(points)
    assert (got[truth < 0] < 0).all()
    outside = got > 0
    np.testing.assert_allclose(got[outside], truth[outside], atol=1e-9)
    assert outside[truth > 6.0].all()


def test_an_airspace_travels_to_other_processes(make):
    airspace = built(make, make.boxes(UNIT), points=[[5, 5, 5]], d_min=1.0)
    points = np.random.default_rng(0).uniform(-10, 15, (200, 3))
    before = airspace.clearance(points)  # builds what must not travel
    again = pickle.loads(pickle.dumps(airspace))  # noqa: S301
    np.testing.assert_array_equal(again.clearance(points), before)
    assert set(vars(again)) >= set(airspace.__dataclass_fields__)


def test_distances_out_of_order_are_refused(make):
    with pytest.raises(ValueError, match="d_min < d_max"):
        build_airspace(make.scene(), make.boxes(UNIT), d_min=5.0, d_max=4.0)


def test_what_cleaning_dropped_keeps_its_distance_too(make):
    mast = replace(make.scene([[5.0, 5.0, 0.5]]), strays=np.array([[0.0, 0.0, 12.0]]))
    airspace = build_airspace(mast, make.boxes([((-9, -9, 0), (-8, -8, 3))]), d_min=2.0, d_max=12.0)
    assert airspace.clearance(np.array([[0.0, 1.5, 12.0]])) == pytest.approx(1.5, abs=1e-9)
    assert not airspace.edge_is_free(np.array([-5.0, 1.5, 12.0]), np.array([5.0, 1.5, 12.0]))
    assert airspace.edge_is_free(np.array([-5.0, 2.5, 12.0]), np.array([5.0, 2.5, 12.0]))
