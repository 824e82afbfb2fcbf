"""The tables of measured figures in the pages are those that are stored, and what is stored is measured."""

from __future__ import annotations

import re
from collections import Counter

import mujoco
import pytest
from figures import STORED, diagnosis, functions, load, pages, written

MARKED = [
    (page, name) for page in pages() for name in re.findall(r'table\("([\w.]+)"', page.read_text(encoding="utf-8"))
]
IN_SECONDS = {"actuation_map.windows", "electronics.current"}
IN_A_QUARTER = {"diagnosis.cases"}
"""Tables that take a quarter of an hour on two cores; a sample of them is measured below."""
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_a_page_says_what_is_stored(page):
    assert written(page) == page.read_text(encoding="utf-8"), "`tox -e figures` writes the stored tables"


def test_every_stored_table_stands_once_in_its_page():
    stored = {path.name.removesuffix(".json") for path in STORED.glob("*.json")}
    assert Counter((page.stem, name) for page, name in MARKED) == {(name.partition(".")[0], name): 1 for name in stored}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in IN_SECONDS else pytest.mark.slow)
        for name in functions()
        if name not in IN_A_QUARTER
    ],
)
def test_what_is_stored_is_measured(name):
    """The same words, and each number to a digit of its last place; to 6 % where another MuJoCo measures."""
    stored, measured = load(name), functions()[name]()
    of_this = "MuJoCo" not in stored["origin"] or mujoco.__version__.startswith(stored["origin"].split()[-1])
    assert len(stored["rows"]) == len(measured)
    for old, new in zip(stored["rows"], measured, strict=True):
        assert [NUMBER.sub("#", cell) for cell in old] == [NUMBER.sub("#", cell) for cell in new]
        for printed, number in zip(NUMBER.findall(" ".join(old)), NUMBER.findall(" ".join(new)), strict=True):
            last_place = 10.0 ** -len(printed.partition(".")[2])
            assert float(number) == pytest.approx(float(printed), abs=1.01 * last_place, rel=0 if of_this else 0.06), (
                old
            )


@pytest.mark.slow
def test_the_first_case_of_each_set_is_played_to_its_end():
    ends = [diagnosis.played(row, 0) for row in range(len(diagnosis.ALL))]
    assert [end.ended for end in ends] == [""] * len(ends)
