"""TSPLIB files: every published optimum comes out, and broken ones say where they break."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import InvalidProblem
from solvers.cases import cases, entrants
from solvers.tour import TourProblem
from solvers.tour.distances import MATRICES, filled
from solvers.tour.instances import (
    random_instance,
    read_tour,
    read_tsplib,
    write_tour,
    write_tsplib,
)

SQUARE = """NAME: square
TYPE: TSP
COMMENT: four corners
DIMENSION: 4
EDGE_WEIGHT_TYPE: {kind}
NODE_COORD_SECTION
1 0 0
2 0 2.5
3 3 2.5
4 3 0
EOF
"""

TRIANGLE = """NAME: triangle
TYPE: TSP
DIMENSION: 3
EDGE_WEIGHT_TYPE: EXPLICIT
EDGE_WEIGHT_FORMAT: UPPER_ROW
EDGE_WEIGHT_SECTION
5 6
7
EOF
"""


@pytest.fixture
def write(tmp_path):
    def write(text, name="file.tsp"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_published_tours_have_their_published_lengths(shared_data):
    folder = shared_data / "optimisation" / "tsplib"
    known = json.loads((folder / "best_known.json").read_text())
    for name, facts in known.items():
        instance = read_tsplib(folder / f"{name}.tsp")
        assert instance.name == name
        assert instance.problem.size == facts["dimension"]
        assert instance.problem.symmetric
        tour = folder / f"{name}.opt.tour"
        if tour.exists():
            assert instance.problem.cost(read_tour(tour)) == facts["best_known"]


@pytest.mark.parametrize(
    ("kind", "side", "diagonal"),
    [
        ("EUC_2D", 3, 4),  # 2.5 and 3.905, to the nearest
        ("CEIL_2D", 3, 4),
        ("MAN_2D", 3, 6),
        ("MAX_2D", 3, 3),
        ("ATT", 1, 2),  # over the root of ten, and up where rounding fell short
    ],
)
def test_distances_follow_their_definition(write, kind, side, diagonal):
    costs = read_tsplib(write(SQUARE.format(kind=kind))).problem.costs
    assert (costs[0, 1], costs[0, 2]) == (side, diagonal)


def test_geographical_distance_of_one_degree_on_the_equator(write):
    text = SQUARE.format(kind="GEO").replace("2 0 2.5", "2 0.0 1.00").replace("3 3 2.5", "3 0 0.30")
    costs = read_tsplib(write(text)).problem.costs
    assert costs[0, 1] == 112  # 111.3 km, and the format adds one before it cuts
    assert costs[0, 2] == 56  # thirty minutes


@given(st.integers(2, 9), st.integers(0, 10**6))
def test_each_order_of_entries_gives_the_same_matrix(n, seed):
    half = np.triu(np.random.default_rng(seed).integers(1, 99, (n, n)).astype(float))
    costs = half + np.triu(half, 1).T
    for form in MATRICES:
        if form == "FULL_MATRIX":
            listed, expected = costs.ravel(), costs
        else:
            upper, by_row, offset = "UPPER" in form, "ROW" in form, 0 if "DIAG" in form else 1
            inside = [
                ij for ij in np.ndindex(n, n) if (ij[1] - ij[0]) * (1 if upper else -1) >= offset
            ]
            inside.sort(key=lambda ij: ij if by_row else ij[::-1])
            listed = np.array([costs[ij] for ij in inside])
            expected = costs - (np.diag(costs.diagonal()) if offset else 0.0)
        np.testing.assert_array_equal(filled(form, n, listed), expected)


@pytest.mark.parametrize(
    ("change", "line", "message"),
    [
        (("DIMENSION: 4", "DIMENSION: four"), 4, "DIMENSION"),
        (("DIMENSION: 4", "DIMENSION: 999999999"), 4, "DIMENSION"),
        (("DIMENSION: 4\n", ""), 5, "DIMENSION"),
        (("TYPE: TSP", "TYPE: CVRP"), 2, "CVRP"),
        (("EUC_2D", "SPECIAL"), 5, "SPECIAL"),
        (("EUC_2D", "EUC_3D"), 5, "3 coordinates"),
        (("3 3 2.5", "3 3 x"), 9, "numbers"),
        (("3 3 2.5", "3 3 1e999"), 9, "finite"),
        (("3 3 2.5", "3 3"), 9, "2 or 3"),
        (("3 3 2.5", "2 3 2.5"), 9, "twice"),
        (("3 3 2.5", "7 3 2.5"), 9, "not one of"),
        (("4 3 0\n", ""), 9, "without place 4"),
        (("NODE_COORD_SECTION", "FIXED_EDGES_SECTION"), 6, "FIXED_EDGES"),
        (("NODE_COORD_SECTION", "hello"), 6, "hello"),
    ],
)
def test_broken_files_say_file_and_line(write, change, line, message):
    path = write(SQUARE.format(kind="EUC_2D").replace(*change))
    with pytest.raises(InvalidProblem, match=message) as caught:
        read_tsplib(path)
    assert str(caught.value).startswith(f"{path}, line {line}: ")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("7\n", ""), "line 7: UPPER_ROW of 3 places has 3 numbers"),
        (("7\n", "7 8\n"), "line 8: UPPER_ROW of 3 places has 3 numbers"),
        (("UPPER_ROW", "SIDEWAYS"), "line 5: SIDEWAYS"),
        (("EDGE_WEIGHT_SECTION\n5 6\n7\n", ""), "no EDGE_WEIGHT_SECTION"),
        (
            ("UPPER_ROW\nEDGE_WEIGHT_SECTION\n", "FULL_MATRIX\nEDGE_WEIGHT_SECTION\n0 1 2 3 4 0 "),
            "TYPE",
        ),
        (("5 6", "-5 6"), "at least"),
    ],
)
def test_broken_matrices_are_named(write, change, message):
    with pytest.raises(InvalidProblem, match=message):
        read_tsplib(write(TRIANGLE.replace(*change)))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidProblem, match=r"nothing\.tsp: cannot be read"):
        read_tsplib(tmp_path / "nothing.tsp")


@pytest.mark.parametrize("body", ["1\n2\n2\n-1", "1\n9\n3\n-1", "1\n2\n-1", "-1", "1.5\n2\n3\n-1"])
def test_broken_tours_are_named(write, body):
    path = write(f"TYPE : TOUR\nDIMENSION : 3\nTOUR_SECTION\n{body}\nEOF\n", "file.tour")
    with pytest.raises(InvalidProblem, match="line"):
        read_tour(path)


def test_a_tour_is_no_problem_and_the_other_way_round(write):
    with pytest.raises(InvalidProblem, match="TYPE TOUR"):
        read_tsplib(write("TYPE : TOUR\nDIMENSION : 1\nTOUR_SECTION\n1\n-1\nEOF\n"))
    with pytest.raises(InvalidProblem, match="TYPE TSP"):
        read_tour(write(TRIANGLE))


@given(st.permutations(range(7)))
@settings(max_examples=20)
def test_tours_come_back(tmp_path_factory, order):
    path = tmp_path_factory.mktemp("tours") / "some.tour"
    write_tour(path, np.array(order), name="some", comment="any")
    np.testing.assert_array_equal(read_tour(path), order)
    path.write_text(path.read_text().replace("DIMENSION : 7\n", ""))  # as some files have it
    np.testing.assert_array_equal(read_tour(path), order)


@pytest.mark.parametrize("symmetric", [True, False])
def test_problems_come_back_digit_for_digit(tmp_path, symmetric):
    costs = np.random.default_rng(3).random((6, 6))
    problem = TourProblem(costs + costs.T if symmetric else costs)
    path = tmp_path / "some.tsp"
    write_tsplib(path, problem, name="some", comment="any")
    back = read_tsplib(path)
    np.testing.assert_array_equal(back.problem.costs, problem.costs)
    assert (back.name, back.comment, back.places) == ("some", "any", None)
    with pytest.raises(InvalidProblem, match="closed"):
        write_tsplib(path, TourProblem(costs, closed=False), name="open")


def test_dice_repeat_by_seed():
    one, same, other = (random_instance(30, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.problem.costs, same.problem.costs)
    assert not np.array_equal(one.problem.costs, other.problem.costs)
    crowded = random_instance(300, 1, clusters=5).problem.costs
    even = random_instance(300, 1).problem.costs
    nearest = [np.sort(costs, axis=1)[:, 1].mean() for costs in (crowded, even)]
    assert nearest[0] < 0.5 * nearest[1]


def test_words_name_the_same_random_places():
    case = cases("tour", ["random:7:3"])[0]
    assert case.name == random_instance(7, 3).name == "random-7-3"
    np.testing.assert_array_equal(case.problem.costs, random_instance(7, 3).problem.costs)


def test_words_that_say_nothing_are_named():
    with pytest.raises(InvalidProblem, match="random:5:5-2: seeds go up; write random:5:2-5"):
        cases("tour", ["random:5:5-2"])
    with pytest.raises(InvalidProblem, match=r'two-opt "x is no solver.*quotation'):
        entrants("tour", ['two-opt "x'])
