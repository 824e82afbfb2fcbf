"""The tables of measured figures in the pages are those that are stored, and what is stored is measured."""

import re
from collections import Counter

import mujoco
import pytest
from click.testing import CliRunner
from figures import ANOTHER_MUJOCO, EXCUSED, STORED, diagnosis, differences, functions, load, pages, written
from figures.__main__ import main

MARKED = [
    (page, name) for page in pages() for name in re.findall(r'table\("([\w.]+)"', page.read_text(encoding="utf-8"))
]
IN_SECONDS = {"actuation_map.windows", "electronics.current"}
IN_MINUTES = {"diagnosis.cases", "campaign.verdict", "campaign.alarms", "validation.units", "validation.staircase"}
"""Tables that take a minute to a quarter of an hour; only `tox -e figures -- --check` measures them."""


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_a_page_says_what_is_stored(page):
    assert written(page) == page.read_text(encoding="utf-8"), "`tox -e figures` writes the stored tables"


def test_every_stored_table_stands_once_in_its_page():
    stored = {path.name.removesuffix(".json") for path in STORED.glob("*.json")}
    assert Counter((page.stem, name) for page, name in MARKED) == {(name.partition(".")[0], name): 1 for name in stored}


def test_every_stored_table_is_measured_or_excused():
    stored = [path.name.removesuffix(".json") for path in STORED.glob("*.json")]
    assert sorted([*functions(), *EXCUSED]) == sorted(stored)


def test_an_excused_table_names_its_commit():
    assert [name for name in EXCUSED if not re.search(r"commits? [0-9a-f]{7}", load(name)["origin"])] == []


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in IN_SECONDS else pytest.mark.slow)
        for name in functions()
        if name not in IN_MINUTES
    ],
)
def test_what_is_stored_is_measured(name):
    stored = load(name)
    of_this = "MuJoCo" not in stored["origin"] or mujoco.__version__.startswith(stored["origin"].split()[-1])
    assert list(differences(stored["rows"], functions()[name](), 0.0 if of_this else ANOTHER_MUJOCO)) == []


OLD = [["channel", "rise, ms"], ["index", "52 to 54"]]


@pytest.mark.parametrize(
    ("new", "agree"),
    [
        ([["channel", "rise, ms"], ["index", "53 to 54"]], True),
        ([["channel", "rise, ms"], ["index", "52 to 56"]], False),
        ([["channel", "rise, s"], ["index", "52 to 54"]], False),
        ([["channel", "rise, ms"]], False),
    ],
)
def test_rows_agree_to_a_unit_of_the_last_place(new, agree):
    assert (not list(differences(OLD, new))) is agree


def test_a_figure_without_a_commit_is_not_stored(monkeypatch):
    monkeypatch.setattr("figures.__main__.functions", lambda: {"electronics.current": None})
    monkeypatch.setattr("figures.__main__.source_commit", lambda: "")
    ended = CliRunner().invoke(main, ["electronics.current"])
    assert ended.exit_code == 2
    assert "names its commit" in ended.output


def test_the_check_names_a_figure_that_differs(monkeypatch):
    monkeypatch.setattr("figures.__main__.functions", lambda: {"electronics.current": lambda: OLD})
    ended = CliRunner().invoke(main, ["--check"])
    assert ended.exit_code == 1
    assert "electronics.current: differs" in ended.output
    assert all(f"{name}: not measured" in ended.output for name in EXCUSED)


@pytest.mark.slow
def test_a_case_is_played_to_its_end():
    assert diagnosis.played(0, 2).ended == ""
