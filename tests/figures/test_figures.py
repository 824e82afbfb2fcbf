"""The tables of measured figures in the pages are those that are stored."""

import re
from collections import Counter

import pytest
from figures import differences, pages, written
from figures.inputs import ROOT
from figures.made import everything
from figures.results import load

MARKED = [
    (page, name) for page in pages() for name in re.findall(r'table\("([\w.]+)"', page.read_text(encoding="utf-8"))
]


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_a_page_says_what_is_stored(page):
    assert written(page) == page.read_text(encoding="utf-8"), "`tox -e figures` writes the stored tables"


def test_every_stored_table_stands_once_in_its_page():
    tables = {name for name in everything() if load(name).rows}
    assert Counter((page.stem, name) for page, name in MARKED) == {(name.partition(".")[0], name): 1 for name in tables}


COMMIT = re.compile(r"\b(?=[0-9a-f]*[0-9])(?=[0-9a-f]*[a-f])[0-9a-f]{7,12}\b")
OF_OTHERS = {"7084ad3", "58b518e", "d7bd82e"}
"""Commits of repositories that are not ours."""


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))], ids=lambda page: page.stem
)
def test_a_page_names_no_commit(page):
    assert set(COMMIT.findall(page.read_text(encoding="utf-8"))) <= OF_OTHERS, "what a page says holds for the present"


OLD = [["channel", "rise, ms", "of"], ["index", "52 to 54", "3"], ["ring", "60", "3"]]


@pytest.mark.parametrize(
    ("new", "agree"),
    [
        ([["channel", "rise, ms"], ["index", "53 to 54"]], True),
        ([["channel", "rise, ms"], ["index", "52 to 56"]], False),
        ([["channel", "rise, s"], ["index", "52 to 54"]], False),
        ([["channel", "rise, ms"], ["middle", "52 to 54"]], False),
        ([["channel", "rise, ms"], ["index", "52 to 54"], ["index", "60"]], False),
    ],
)
def test_a_part_agrees_to_a_unit_of_the_last_place(new, agree):
    assert (not list(differences(OLD, new))) is agree
