"""Three ways to the same distance: FCL, the tree of boxes, and all pairs; and the bounds."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.airspace.airspace import build_airspace
from planner.airspace.collision import Triangles
from planner.airspace.field import DistanceField, TriangleTree
from planner.config import AirspaceSettings
from planner.scene.cloud import Mesh

seeds = st.integers(0, 2**31)


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(1, 80), st.sampled_from([(0.05, 0), (1.0, 1), (30.0, 0), (30.0, 1)]))
def test_three_ways_agree_on_the_distance_to_a_soup(make, brute, seed, count, place):
    scale, far = place
    mesh = make.soup(seed, count, size=2.0 if seed % 2 else 8.0)
    mesh = Mesh(mesh.vertices * scale + np.array([800.0, -900, 30]) * far, mesh.triangles)
    rng = np.random.default_rng(seed)
    middle = mesh.vertices.mean(axis=0)
    points = middle + rng.normal(0, 15 * scale, (80, 3)) * 10 ** rng.uniform(-2, 0.7, (80, 1))
    points = np.concatenate([points, mesh.vertices[:5]])
    sound = Mesh(mesh.vertices, mesh.triangles[count // 4 :])
    for part, tolerance in ((mesh, 1e-5 * scale), (sound, 1e-7)):  # with needles, without
        truth = brute.points(points, part.vertices[part.triangles])
        np.testing.assert_allclose(TriangleTree(part).distance(points), truth, atol=1e-9)
        np.testing.assert_allclose(Triangles(part).distance(points), truth, rtol=0, atol=tolerance)


def test_one_triangle_is_found_from_any_distance(brute):
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]]))
    points = np.random.default_rng(0).normal(size=(200, 3)) * 10 ** np.linspace(-3, 3, 200)[:, None]
    np.testing.assert_allclose(
        TriangleTree(mesh).distance(points), brute.points(points, mesh.vertices[mesh.triangles])
    )


def test_a_few_huge_triangles_among_many_small_ones_do_not_explode(make, brute):
    soup = make.soup(3, 3000, size=0.05, spread=40.0)
    ground = make.sheet((-4000, -4000), (4000, 4000), 0.0)
    mesh = make.join(soup, ground)
    points = np.random.default_rng(0).uniform((-60, -60, 0), (60, 60, 60), (60, 3))
    truth = brute.points(points, mesh.vertices[mesh.triangles])
    np.testing.assert_allclose(TriangleTree(mesh).distance(points), truth, atol=1e-9)


BLOCKS = [((-14, -14, 0), (-6, -6, 12)), ((4, -12, 0), (12, -2, 7)), ((2, 6, 9), (16, 10, 10))]


@pytest.fixture(scope="module")
def pair(make):
    mast = np.column_stack([np.zeros((40, 2)), np.linspace(0, 14, 40)])
    airspace = build_airspace(make.scene(mast), make.boxes(BLOCKS), d_min=2.0, d_max=15.0)
    return airspace, DistanceField.from_arrays(airspace.to_arrays())


def test_both_implementations_agree_on_clearance_and_side(pair):
    airspace, field = pair
    points = np.random.default_rng(0).uniform((-34, -34, -2), (34, 34, 30), (4000, 3))
    planned, checked = airspace.clearance(points), field.clearance(points)
    np.testing.assert_array_equal(planned >= 2.0, checked >= 2.0)
    same = (planned > 0) == (checked > 0)
    np.testing.assert_allclose(checked[same], planned[same], atol=1e-9)
    assert same.mean() > 0.999  # in sharp corners one of them may find no way out
    np.testing.assert_allclose(
        field.exact_distance(points),
        np.minimum(field.surface_distance(points), field.raw_distance(points)),
    )


def test_the_lattice_is_a_lower_bound_everywhere(pair, solids):
    _, field = pair
    points = np.random.default_rng(1).uniform((-34, -34, -2), (34, 34, 30), (6000, 3))
    truth = np.minimum(solids(BLOCKS, ground=0.0).clearance(points), field.raw_distance(points))
    bound = field.lower_bound(points)
    assert (bound <= truth + 1e-9).all()
    proven = np.isfinite(bound)
    assert (truth[proven] > 0).all()
    assert proven[truth >= 2.0].all()
    near = proven & (truth < 2.0)
    assert (truth - bound)[near].max() <= 2.0 * field.error + 1e-5
    assert field.error == pytest.approx(0.5 * np.sqrt(3) * 0.5 * 2.0)


def test_along_a_segment_the_bound_is_true_and_tight(pair, solids):
    _, field = pair
    rng = np.random.default_rng(2)
    a, b = rng.uniform((-34, -34, 0), (34, 34, 30), (2, 80, 3))
    bound = field.lower_bound_along(a, b, tolerance=0.1)
    exact = solids(BLOCKS, ground=0.0)
    for k in range(len(a)):
        along = a[k] + np.linspace(0, 1, 800)[:, None] * (b[k] - a[k])
        least = np.minimum(exact.clearance(along), field.raw_distance(along)).min()
        assert bound[k] <= least + 1e-9
        if least > 0.5:
            assert bound[k] >= least - 0.1 - np.linalg.norm(b[k] - a[k]) / 1598
    assert np.isfinite(bound).any()
    assert np.isneginf(bound).any()
    with pytest.raises(ValueError, match="tolerance"):
        field.lower_bound_along(a, b, tolerance=0.0)


def test_raw_points_are_a_witness_of_their_own(pair):
    _, field = pair
    at = np.array([[1.5, 0, 7.0]])
    assert field.raw_distance(at)[0] == pytest.approx(1.5, abs=0.02)
    assert field.clearance(at)[0] == pytest.approx(field.raw_distance(at)[0])
    assert field.surface_distance(at)[0] > 3.0


def test_what_is_beyond_the_known_space_is_never_proven(pair):
    _, field = pair
    points = np.array([[36.0, 0, 10], [0, 0, 36], [np.nan, 0, 5], [np.inf, 0, 0], [0, 0, 30]])
    for answer in (field.clearance(points), field.lower_bound(points)):
        assert np.isneginf(answer[:4]).all()
        assert answer[4] > 10


def test_inside_of_a_hollow_shell_nothing_is_proven(make):
    airspace = build_airspace(
        make.scene(), make.boxes([((-10, -10, 0), (10, 10, 18))]), d_min=2.0, d_max=15.0
    )
    field = DistanceField.from_arrays(airspace.to_arrays())
    points = np.random.default_rng(0).uniform((-9, -9, 0.5), (9, 9, 17), (300, 3))
    assert field.clearance(points).max() < 0
    assert np.isneginf(field.lower_bound(points)).all()
    assert np.isneginf(field.lower_bound_along(points[:9], points[9:18])).all()


def test_under_a_roof_without_walls_the_stored_curtains_close_the_building(make):
    roof = make.sheet((-8, -8), (8, 8), 14.0)
    airspace = build_airspace(make.scene(), roof, d_min=2.0, d_max=15.0)
    field = DistanceField.from_arrays(airspace.to_arrays())
    assert airspace.parts[2] > 0
    assert field.clearance(np.array([[0, 0, 7.0], [5, 5, 3]])).max() < 0
    assert field.clearance(np.array([[0, 0, 18.0]]))[0] == pytest.approx(4.0)


def test_a_coarse_lattice_proves_the_same_places_outside(pair, monkeypatch):
    airspace, _ = pair
    monkeypatch.setattr("planner.airspace.field._MOST_CELLS", 2500)
    field = DistanceField.from_arrays(airspace.to_arrays())
    assert field.lattice.cell > 2.0 * airspace.d_min
    points = np.random.default_rng(0).uniform((-34, -34, 0), (34, 34, 30), (3000, 3))
    planned, checked = airspace.clearance(points), field.clearance(points)
    assert (checked <= planned + 1e-9).all()
    clear = planned >= 2.0
    assert (checked[clear] >= 2.0).mean() > 0.98
    bound = field.lower_bound(points)
    assert (bound <= planned + 1e-9).all()


@pytest.mark.parametrize("beyond", [1e3, 1e4, 1e6])
def test_a_space_much_wider_than_the_scene_proves_the_same_places_outside(make, beyond):
    settings = AirspaceSettings(beyond=beyond)
    airspace = build_airspace(
        make.scene(), make.boxes(BLOCKS), d_min=2.0, d_max=15.0, settings=settings
    )
    field = DistanceField.from_arrays(airspace.to_arrays())
    rng = np.random.default_rng(0)
    points = rng.uniform((-34, -34, 0), (34, 34, 60), (500, 3))
    planned, checked = airspace.clearance(points), field.clearance(points)
    assert (checked <= planned + 1e-9).all()
    assert (checked >= 2.0)[planned >= 2.0].mean() > (0.98 if beyond <= 1e4 else 0.3)
    buried = rng.uniform((-34, -34, -60), (34, 34, -0.5), (500, 3)) * [beyond / 40.0, 1.0, 1.0]
    assert field.clearance(buried).max() < 0.0


def test_the_second_opinion_never_loads_the_first():
    code = (
        "import sys, numpy as np\n"
        "from planner.airspace.field import DistanceField\n"
        "from planner.scene.cloud import Mesh\n"
        "corners = np.array([[-9, -9, 0], [9, -9, 0], [0, 9, 0.0]])\n"
        "field = DistanceField(Mesh(corners, np.array([[0, 1, 2]])), np.zeros((1, 3)),\n"
        "    np.full(3, -5.0), np.full(3, 5.0), 1.0)\n"
        "field.clearance(np.array([[0, 0, 3.0]]))\n"
        "print([m for m in ('fcl', 'planner.airspace.collision', 'planner.airspace.occupancy')\n"
        "    if m in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
