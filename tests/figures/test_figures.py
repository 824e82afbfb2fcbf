"""Every table of measured figures in the pages says what its function measures."""

from __future__ import annotations

import json
import re
from collections import Counter

import pytest
from figures import sources as registry
from figures.cells import Cell, Tolerance
from figures.pages import ROOT, measured, moved, pages
from figures.sources import Cost, Source, sources, table
from figures.stored import folder
from hypothesis import given
from hypothesis import strategies as st

QUICK = (Cost.QUICK, Cost.STORED)
MARKED = [
    (page, name) for page in pages() for name in re.findall(r'table\("([\w.]+)"', page.read_text(encoding="utf-8"))
]
HALF = Tolerance("of a test", last_place=0.5, other_physics=0.06)


def holding(costs):
    names = {name for name, source in sources().items() if source.cost in costs}
    return sorted({page for page, name in MARKED if name in names})


def agrees(page, costs):
    if lines := list(moved(page, measured(page, costs))):
        pytest.fail("\n".join((*lines, "`tox -e figures` writes what is measured")), pytrace=False)


@pytest.mark.parametrize("page", holding(QUICK), ids=lambda page: page.name)
def test_what_is_printed_is_what_is_measured(page):
    agrees(page, QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("page", holding((Cost.SLOW,)), ids=lambda page: page.name)
def test_what_is_printed_is_what_is_measured_in_minutes(page):
    agrees(page, (Cost.SLOW,))


def test_every_table_stands_once_in_its_page():
    assert Counter((page.stem, name) for page, name in MARKED) == {
        (name.partition(".")[0], name): 1 for name in sources()
    }


@pytest.fixture
def of_a_test(monkeypatch):
    def measure():
        return [("channel", "rms"), ("index", Cell.of("{:.2f} ({:.2f})", 0.2341, 0.45)), ("ring", Cell.of("{:.2f}", 1))]

    made = {"page.name": Source(measure, "a command", HALF), "page.slow": Source(measure, "another", HALF, Cost.SLOW)}
    monkeypatch.setattr(registry, "sources", lambda: made)


def test_a_figure_changed_by_hand_is_told_with_page_and_line(of_a_test, tmp_path, monkeypatch):
    monkeypatch.setattr("figures.pages.ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text('# A\n<!-- [[[cog cog.out(table("page.name", cog.previous)) ]]] -->\n<!-- [[[end]]] -->\n')
    page.write_text(measured(page, QUICK))
    assert list(moved(page, measured(page, QUICK))) == []
    page.write_text(page.read_text().replace("0.23 (", "0.26 ("))
    assert list(moved(page, measured(page, QUICK))) == [
        "page.md:6:\n  printed  | index | 0.26 (0.45) |\n  measured | index | 0.23 (0.45) |"
    ]


def test_what_is_slow_stays_as_it_is_when_only_the_quick_is_measured(of_a_test):
    assert table("page.slow", "as printed", QUICK) == "as printed"
    assert "0.23 (0.45)" in table("page.slow", "as printed")


def test_a_figure_that_moved_within_its_tolerance_stays_as_it_is_printed(of_a_test):
    printed = table("page.name", "").replace("0.23 (0.45)", "0.24 (0.45)")
    assert table("page.name", printed) == printed


def test_another_physics_engine_may_move_a_figure_further(of_a_test, monkeypatch):
    printed = table("page.name", "").replace("0.23 (0.45)", "0.24 (0.44)").replace("MuJoCo", "MuJoCo 0.9, not")
    printed = re.sub(r"MuJoCo 0.9, not .*", "MuJoCo 0.9.", printed)
    assert table("page.name", printed) == printed
    beyond = table("page.name", printed.replace("0.24", "0.26"))
    assert beyond == table("page.name", "")


@pytest.mark.parametrize("printed", ["0.25 (0.45)", "0.23 (0.47)", "0.23 [0.45]", "0.23", "-0.23 (0.45)", ""])
def test_another_figure_or_another_text_does_not_stand(printed):
    assert not Cell.of("{:.2f} ({:.2f})", 0.2341, 0.45).stands(printed, HALF)


@given(st.floats(-1e6, 1e6), st.sampled_from(["{:.0f}", "{:.2f}", "{:.3g}", "{:+.1f} %", "{:.1e} mm"]))
def test_a_cell_stands_as_it_is_written(value, template):
    cell = Cell.of(template, value)
    assert cell.stands(cell.text, Tolerance("of a test"))


@given(st.floats(-1e3, 1e3), st.floats(0.0, 3.0))
def test_the_tolerance_is_counted_from_the_measured_figure(value, off):
    """0.5 of the last digit beyond the 0.5 of rounding: one unit of it."""
    stands = Cell.of("{:.2f}", value).stands(f"{value + off:.4f}"[:-2], HALF)
    printed = float(f"{value + off:.4f}"[:-2])
    assert stands == (abs(printed - value) <= 0.01 + 1e-8)


def test_the_relative_tolerance_is_that_of_the_printed_figure():
    tenth = Tolerance("of a test", relative=0.1)
    assert Cell.of("{:.0f}", 109.0).stands("100", tenth)
    assert not Cell.of("{:.0f}", 112.0).stands("100", tenth)


@pytest.mark.parametrize("file", sorted(folder().glob("*.json")), ids=lambda file: file.stem)
def test_a_stored_result_says_where_it_comes_from(file):
    origin = json.loads(file.read_text(encoding="utf-8"))["provenance"]
    assert origin["seeds"]
    for commit in re.split(r", | and ", origin["commit"]):
        assert re.fullmatch(r"[0-9a-f]{7,40}", commit)


def test_the_pages_are_found():
    assert ROOT / "docs" / "validation.md" in pages()
