"""Settings are strict, and survive being written and read."""

import time
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.config import Config, ZoneSettings, load_config
from planner.errors import PlannerError


@given(
    st.integers(0, 2**31),
    st.floats(0.001, 50.0),
    st.one_of(st.none(), st.floats(1.0, 200.0)),
    st.text(max_size=20),
)
def test_settings_survive_toml(seed, radius, ceiling, name):
    zone = {"polygon": ((0.0, 0.0), (1.0, 0.5), (0.0, 1.0)), "name": name}
    config = Config.model_validate(
        {
            "seed": seed,
            "scale": {"radius": radius},
            "airspace": {"ceiling": ceiling, "zones": (zone,)},
        }
    )
    assert Config.model_validate(tomllib.loads(config.to_toml())) == config


def test_assignments_are_applied_after_the_file(tmp_path):
    path = tmp_path / "scan.toml"
    path.write_text("[route]\nsolver = 'nearest'\nclosed = true\n")
    config = load_config(path, ["route.solver=ortools", "scale.gsd=0.02"])
    assert (config.route.solver, config.route.closed, config.scale.gsd) == ("ortools", True, 0.02)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("[route]\nsolvr = 'x'\n", r"route\.solvr = 'x'; did you mean route\.solver\?"),
        ("speed = 3\n", r"unknown setting speed = 3; did you mean flight\.speed\?"),
        ("[scale]\nradius = -1.0\n", r"scale\.radius = -1\.0"),
        ("[scale\n", "not valid TOML"),
        ("seed = nan\n", "seed"),
    ],
)
def test_a_wrong_setting_is_named_with_its_file_in_one_line(tmp_path, text, named):
    path = tmp_path / "scan.toml"
    path.write_text(text)
    with pytest.raises(PlannerError, match=named) as caught:
        load_config(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("assignment", ["route", "=3", "route.=3", "seed.x=1", "route.solver"])
def test_what_is_no_assignment_is_refused(assignment):
    with pytest.raises(PlannerError):
        load_config(None, ["seed=1", assignment])


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(PlannerError, match=r"none\.toml"):
        load_config(tmp_path / "none.toml")


@pytest.mark.parametrize("side", ["width_px", "height_px"])
def test_a_picture_that_no_camera_takes_is_refused(side):
    assert load_config(None, [f"camera.{side}=100000"])
    with pytest.raises(PlannerError, match=f"{side}.*100,?000"):
        load_config(None, [f"camera.{side}=100001"])


PENTAGRAM = [[0, 3], [2, -3], [-3, 1], [3, 1], [-2, -3]]


@pytest.mark.parametrize(
    ("zone", "complaint"),
    [
        ({"polygon": PENTAGRAM}, "cross"),
        ({"polygon": [[0, 0], [2, 2], [2, 0], [0, 2.1]]}, "cross"),
        ({"polygon": [[0, 0], [1, 1], [2, 2]]}, "no area"),
        ({"polygon": [[0, 0], [1, 0], [1, 1]], "bottom": 5.0, "top": 1.0}, "not below"),
    ],
)
def test_a_zone_that_would_not_forbid_what_it_shows_is_refused(zone, complaint):
    with pytest.raises(ValueError, match=complaint):
        Config.model_validate({"airspace": {"zones": [zone]}})


def test_concave_zones_are_fine():
    zone = {"polygon": [[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]]}
    assert len(Config.model_validate({"airspace": {"zones": [zone]}}).airspace.zones) == 1


def crossing_sides(corners):
    """First two sides that cross, worked out one by one."""
    sides = list(zip(corners, [*corners[1:], corners[0]], strict=True))

    def turn(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    for i, (a, b) in enumerate(sides):
        for c, d in sides[i + 1 :]:
            if turn(a, b, c) * turn(a, b, d) < 0 and turn(c, d, a) * turn(c, d, b) < 0:
                return (a, b), (c, d)
    return None


@pytest.mark.parametrize("pairs", [10, 500_000])
def test_the_first_two_sides_that_cross_are_named(monkeypatch, pairs):
    monkeypatch.setattr("planner.prism._PAIRS", pairs)
    rng, seen = np.random.default_rng(0), set()
    for _ in range(200):
        grid = rng.integers(0, 9, (rng.integers(3, 7), 2)).astype(np.float64)
        corners = [tuple(corner) for corner in grid.tolist()]
        expected = crossing_sides(corners)
        try:
            ZoneSettings(polygon=corners)
            found = None
        except ValueError as error:
            if "no area" in str(error):
                continue
            found = str(error)
        assert (found is None) == (expected is None)
        assert expected is None or f"sides {expected[0]} and {expected[1]} of" in found
        seen.add(expected is None)
    assert seen == {True, False}


def test_an_outline_of_thousands_of_corners_is_read_in_a_moment():
    turns = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    corners = np.column_stack([np.cos(turns), np.sin(turns)]) * 50.0
    began = time.process_time()
    ZoneSettings(polygon=corners.tolist())
    assert time.process_time() - began < 2.0
    corners[[1000, 3000]] = corners[[3000, 1000]]
    with pytest.raises(ValueError, match="cross"):
        ZoneSettings(polygon=corners.tolist())


@pytest.mark.parametrize("text", ["[" * 20000, "1\n[camera]\nwidth_px = 20"])
def test_an_assignment_sets_one_value_or_is_refused(text):
    with pytest.raises(PlannerError, match="seed"):
        load_config(None, [f"seed={text}"])
