"""Whatever is wrong with settings is said in plain words, in one line."""

import datetime
import re

import pytest
from pydantic import ValidationError

from planner.config import Config, ZoneSettings, load_config
from planner.errors import PlannerError
from planner.mistakes import first_mistake
from planner.settings import is_table

RAW = re.compile(
    r"Input should|Value error|[a-z]+_(error|type|parsing|than|equal|length|number)\b|validation|"
    r"literal\[|pydantic|Field required|Extra inputs|\n"
)
TRIANGLE = "polygon = [[0, 0], [9, 0], [0, 9]]"


def refused(tmp_path, text):
    path = tmp_path / "scan.toml"
    path.write_text(text)
    with pytest.raises(PlannerError) as caught:
        load_config(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    line = line.removeprefix(f"{path}: ")
    assert not RAW.search(line)
    return line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "viewpoints.preset = 'covers'",
            "setting viewpoints.preset = 'covers' is refused: it must be "
            '"cover", "paper" or "smith"; change or remove it',
        ),
        (
            "scale.radius = -1.0",
            "setting scale.radius = -1.0 is refused: it must be a number above 0 (m); "
            "change or remove it",
        ),
        (
            "scale.radius = inf",
            "setting scale.radius = inf is refused: it must be a finite number above 0 (m); "
            "change or remove it",
        ),
        (
            "viewpoints.hits = 3.5",
            "setting viewpoints.hits = 3.5 is refused: it must be a whole number from 1 to 20; "
            "change or remove it",
        ),
        (
            "scene.unit = 'feet'",
            "setting scene.unit = 'feet' is refused: it must be a number above 0 or \"auto\"; "
            "change or remove it",
        ),
        (
            "scene.crs = 25832",
            "setting scene.crs = 25832 is refused: it must be text; change or remove it",
        ),
        (
            "route.start = [1, 2]",
            "setting route.start = [1, 2] is refused: it must be 3 numbers; change or remove it",
        ),
        (
            "sorties.stations = [[0, 0], [1]]",
            "setting sorties.stations[1] = [1] is refused: it must be 2 or 3 numbers; "
            "change or remove it",
        ),
        (
            "sorties.stations = [[0, 0], [1, 'x']]",
            "setting sorties.stations[1][1] = 'x' is refused: it must be a number; "
            "change or remove it",
        ),
        (
            "airspace.zones = [{polygon = [[0, 0], [9, 0]]}]",
            "setting airspace.zones[0].polygon = [[0, 0], [9, 0]] is refused: it must be "
            "a list of 2 numbers each, at least 3 of them; change or remove it",
        ),
        (
            "airspace.zones = [{}]",
            "setting airspace.zones[0].polygon is missing; give a list of 2 numbers each, "
            "at least 3 of them",
        ),
        (
            f"airspace.zones = [{{{TRIANGLE}, kind = 'out'}}]",
            "setting airspace.zones[0].kind = 'out' is refused: it must be "
            '"keep_out" or "keep_in"; change or remove it',
        ),
        (
            f"airspace.zones = [{{{TRIANGLE}, bottom = 9, top = 1}}]",
            "airspace.zones[0]: bottom 9.0 is not below top 1.0; raise top or lower bottom",
        ),
        (
            "scale = 3",
            "setting scale = 3 is refused: it must be a table of settings such as radius, "
            "radius_share, gsd; change or remove it",
        ),
        (
            "[viewpoints]\nbudget = 5\npreset = 'paper'",
            'viewpoints: budget needs preset "cover" with objective "reconstructability", not '
            '"paper" with "reconstructability"; change these or leave budget = 5 out',
        ),
        (
            "[viewpoints]\nbudget = 5\nminutes = 2.5",
            "viewpoints: minutes = 2.5 and budget = 5 are both set; leave one of them out",
        ),
    ],
)
def test_a_wrong_value_is_told_with_what_is_allowed(tmp_path, text, line):
    assert refused(tmp_path, text) == line


@pytest.mark.parametrize(
    ("key", "meant"),
    [
        ("route.solvr", "route.solver"),
        ("viewpoint.budget", "viewpoints"),
        ("speed", "flight.speed"),
        ("route.margin", "flight.margin"),
        ("gsd", "scale.gsd"),
        ("solver", "viewpoints.solver or route.solver or flight.solver"),
        ("scale.dmin", "scale.d_min"),
        ("camera.ceilin", "airspace.ceiling"),
    ],
)
def test_the_nearest_known_setting_is_suggested(tmp_path, key, meant):
    hint = f"; did you mean {meant}? (scanwright settings lists all)"
    assert hint in refused(tmp_path, f"{key} = 3")
    with pytest.raises(
        PlannerError, match=f"^--set: unknown setting {key.split('.')[0]}"
    ) as caught:
        load_config(None, [f"{key}=3"])
    assert hint in str(caught.value)


def test_mistyped_settings_of_a_zone_are_suggested_too(tmp_path):
    line = refused(tmp_path, f"airspace.zones = [{{{TRIANGLE}, botom = 1}}]")
    assert "airspace.zones[0].botom = 1; did you mean airspace.zones[0].bottom?" in line


def test_what_is_like_nothing_gets_the_list(tmp_path):
    assert "zzz = 1; known here: seed, scene, camera" in refused(tmp_path, "zzz = 1")


@pytest.mark.parametrize(
    "key", ["camera.sensor", "viewpoints.overlap", "flight.height", "camera.f"]
)
def test_what_is_like_nothing_in_its_table_gets_the_list_of_that(key):
    table = dict(Config.model_fields)[key.split(".")[0]].annotation
    with pytest.raises(
        PlannerError, match=f"{key} = 1; known here: {', '.join(list(table.model_fields)[:5])}"
    ):
        load_config(None, [f"{key}=1"])


@pytest.mark.parametrize("key", ["a\nb", "a\u2028b", "", "\x1b[31m"])
@pytest.mark.parametrize("table", [(), ("camera",), ("airspace",)])
def test_an_odd_key_is_told_in_one_line(key, table):
    tree = {key: 1}
    for name in table:
        tree = {name: tree}
    with pytest.raises(ValidationError) as caught:
        Config.model_validate(tree)
    line = first_mistake(caught.value, Config)[1]
    assert len(line.splitlines()) == 1
    assert f"unknown setting {''.join(f'{name}.' for name in table)}{key!r} = 1; known" in line


def test_what_was_set_on_the_command_line_is_not_blamed_on_the_file(tmp_path):
    path = tmp_path / "scan.toml"
    path.write_text("viewpoints.minutes = 5.0")
    for assignment, start in (
        ("scale.radius=-1", "--set: setting scale.radius"),
        ("viewpoints.budget=3", f"{path} with --set: viewpoints: minutes"),
    ):
        with pytest.raises(PlannerError) as caught:
            load_config(path, [assignment])
        assert str(caught.value).startswith(start)


@pytest.mark.parametrize("value", ["[zones.geojson]", "{a", "'x", '"x'])
def test_a_list_that_is_none_is_no_text(value):
    with pytest.raises(PlannerError, match=r"--set airspace.zone_files: .*not valid TOML"):
        load_config(None, [f"airspace.zone_files={value}"])


def test_brackets_without_end_are_no_settings_file(tmp_path):
    assert "not valid TOML" in refused(tmp_path, "seed = " + "[" * 20_000)


WRONG = [
    *("", "x", "é\n" * 99, "9" * 5000, True, -1, 0, 3.5, -1e308, 1e308, 10**400, 1),
    *(float("nan"), float("inf"), -float("inf"), [], {}, [[]], [1], [1, 2, 3, 4], ["x", "y"]),
    *([[1]], [[1, 2, 3, 4]], [{}], [[1, float("nan")]], {"x": 1}, {1: 2}, [[["x"]]], None),
    *(datetime.date(2020, 1, 1), datetime.time(1), [datetime.datetime(2020, 1, 1, 2)]),
]


def every_setting(table=Config, prefix=()):
    for key, field in table.model_fields.items():
        yield (*prefix, key)
        if is_table(field.annotation):
            yield from every_setting(field.annotation, (*prefix, key))


@pytest.mark.parametrize("keys", list(every_setting()), ids=".".join)
def test_no_wrong_value_of_any_setting_is_told_in_words_of_another_library(keys):
    seen = 0
    for value in WRONG:
        tree = value
        for key in reversed(keys):
            tree = {key: tree}
        try:
            Config.model_validate(tree)
        except ValidationError as error:
            found, line = first_mistake(error, Config)
            assert found[: len(keys)] == keys[: len(found)]
            assert all(key in line for key in keys)
            assert not RAW.search(line), line
            assert len(line) < 400
            assert ";" in line
            seen += 1
    assert seen > 5


@pytest.mark.parametrize("key", list(ZoneSettings.model_fields))
def test_no_wrong_value_of_any_zone_is_either(key):
    zone = {"polygon": [[0, 0], [9, 0], [0, 9]]}
    for value in WRONG:
        try:
            Config.model_validate({"airspace": {"zones": [zone, {**zone, key: value}]}})
        except ValidationError as error:
            found, line = first_mistake(error, Config)
            assert found[:3] == ("airspace", "zones", 1)
            assert "airspace.zones[1]" in line
            assert not RAW.search(line), line
            assert ";" in line
