"""Table of examples/grasps/grasps.md."""

from __future__ import annotations

from collections.abc import Iterable

from grasps.__main__ import main
from grasps.grasp import Grasp
from grasps.skin import Skin
from grasps.taxonomy import GRASPS
from grasps.trial import hold

from figures.inputs import ROOT
from figures.results import Rows, Shipped
from figures.sample_text import numbers
from model.units.plausible import unit_named

HANDS = ("ideal", "reference")
HEADER = ["", "grasp", *HANDS, "failure on `reference`", "gives way first"]


def held() -> Rows:
    """Grasps that hold on two hands."""
    rows = _rows(GRASPS)
    counts = (str(sum(row[2 + place] == "yes" for row in rows)) for place in range(len(HANDS)))
    return [HEADER, *rows, ["", f"held, of {len(rows)}", *counts, "", ""]]


def some() -> Rows:
    """The first grasps of the table."""
    return [HEADER, *_rows(GRASPS[:8])]


def _rows(grasps: Iterable[Grasp]) -> list[list[str]]:
    rows = []
    for grasp in grasps:
        results = [hold(grasp, unit_named(name), Skin.SILICONE) for name in HANDS]
        held = ("yes" if one.held else "no" for one in results)
        rows.append([str(grasp.number), grasp.name, *held, results[-1].failure, results[-1].gave_way])
    return rows


def postures() -> Rows:
    """Postures of the first grasps of the picture."""
    hand = unit_named(HANDS[0])
    found = ([one.name, numbers(hold(one, hand, Skin.SILICONE).pose)] for one in GRASPS[:4])
    return [("grasp", "posture"), *found]


def draw() -> None:
    """Draw all grasps on the first hand; needs OpenGL."""
    main(["--unit", HANDS[0], "--picture", str(ROOT / "examples" / "grasps" / "grasps.jpg")], standalone_mode=False)


TABLES = (held,)
SAMPLES = {held: some}
SHIPPED = {"picture": Shipped(("examples/grasps/grasps.jpg",), ("grasps.picture",), postures, draw)}
