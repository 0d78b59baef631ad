"""The manual of settings follows from their declarations."""

import json
import tomllib
from pathlib import Path

import pytest

from planner import cli
from planner.config import Config, load_config
from planner.manual import page, records, template

PAGE = Path(__file__).parents[2] / "docs" / "settings.md"


def printed(monkeypatch, capsys, *options):
    monkeypatch.setattr("sys.argv", ["scanwright", "settings", *options])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code in {0, None}
    return capsys.readouterr().out


def test_the_page_in_the_docs_is_what_the_command_prints(monkeypatch, capsys):
    assert printed(monkeypatch, capsys) == page() == PAGE.read_text(encoding="utf-8"), (
        "run: scanwright settings > docs/settings.md"
    )


def leaves(tree, prefix=""):
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def test_every_setting_has_a_row_with_its_default(monkeypatch, capsys):
    rows = {row["name"]: row for row in json.loads(printed(monkeypatch, capsys, "--json"))}
    assert list(rows.values()) == records()
    for name, default in leaves(Config().model_dump(mode="json")):
        assert rows.pop(name)["default"] == default, name
    assert {name.rpartition(".")[0] for name in rows} == {"airspace.zones[]"}
    assert [name for name, row in rows.items() if row["required"]] == ["airspace.zones[].polygon"]


@pytest.mark.parametrize("row", records(), ids=lambda row: row["name"])
def test_every_setting_says_in_one_sentence_what_it_does(row):
    assert len(row["does"]) > 10
    assert row["does"].endswith((".", ")."))
    assert "|" not in row["does"] + row["takes"]  # it would end a cell
    suffixes = {"_deg": "degrees", "_px": "px", "_seconds": "s", "_percent": "%"}
    for suffix, unit in suffixes.items():
        if row["name"].endswith(suffix):
            assert row["unit"] in {unit, f"{unit}/s"}


def test_the_file_of_defaults_is_the_defaults(tmp_path, monkeypatch, capsys):
    text = printed(monkeypatch, capsys, "--toml")
    assert text == template()
    path = tmp_path / "scan.toml"
    path.write_text(text, encoding="utf-8")
    assert load_config(path) == Config()


def test_what_the_file_of_defaults_leaves_out_can_be_written_where_it_stands(tmp_path):
    """Unset settings and zones stand in their tables."""
    given = {
        "# radius = ...": "radius = 1.5",
        "# start = ...": "start = [1.0, 2.0, 3.0]",
        "# [[airspace.zones]]": "[[airspace.zones]]",
        "# polygon = ...": "polygon = [[0, 0], [9, 0], [0, 9]]",
        '# heights = "local"': 'heights = "ground"',
    }
    text = template()
    for shown, written in given.items():
        assert text.count(f"\n{shown}\n") == 1
        text = text.replace(f"\n{shown}\n", f"\n{written}\n")
    config = Config.model_validate(tomllib.loads(text))
    assert (config.scale.radius, config.route.start) == (1.5, (1.0, 2.0, 3.0))
    assert config.airspace.zones[0].heights == "ground"


def test_two_forms_at_once_are_refused(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["scanwright", "settings", "--toml", "--json"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    assert "choose one" in capsys.readouterr().err
