"""Pictures of the pages, each with a sample of what it shows."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import hil
from aero.policy.running import RunSettings
from aero.policy.shipped import DEFAULT, find_policy
from figures.inputs import ROOT
from figures.picture import write_report, write_view
from figures.results import Rows, Shipped
from figures.sample_text import numbers, rows_of
from hil.emulated.emulated_spec import EmulatedSpec
from hil.verdict.sentences import channel_sentences
from hil.verdict.validation import validate
from simulator.pictures import POSE, write_picture
from simulator.routed import build_routed
from simulator.scene import CUBE
from train.evaluation.cube_trial import run_trial

DOCS = ROOT / "docs"


def failing_report() -> Rows:
    """Sentences of the report in the picture."""
    with hil.emulate(faults=("motor_dead:ring",)) as target:
        found = validate(target)
    return [("sentences",), [found.tally.words], *([one] for one in channel_sentences(found))]


def turning() -> Rows:
    """The cube of the film, after two seconds."""
    trial = run_trial(find_policy(DEFAULT), EmulatedSpec(unit="reference", cube=CUBE), RunSettings(seconds=2.0))
    return [("rate, rad/s", "kept"), [f"{trial.rate_rad_s:.3f}", str(trial.kept)]]


def routed_picture() -> Rows:
    """Places of the bodies of the hand in the picture."""
    compiled = build_routed().compile()
    names = [compiled.body(place).name for place in range(compiled.nbody)]
    bodies = [[name, numbers(compiled.body(name).pos)] for name in names]
    return [("body", "place, m"), *bodies, ["pose, rad", numbers(POSE.values())]]


def view() -> Rows:
    """Excursions of the hand on the page in the picture."""
    with hil.emulate() as target:
        found = validate(target, ["presence", "audit", "excursion"])
    return rows_of(found.numbers["excursion"])


def make_film() -> None:
    """Run the policy for 8 s and film it; needs OpenGL."""
    with TemporaryDirectory() as folder:
        recorded, film = str(Path(folder) / "turning.mcap"), str(DOCS / "turning.webp")
        # each a process, because a command ends its process
        for command in (
            ["run-policy", "--unit", "reference", "--seconds", "8", "--record", recorded],
            ["export", recorded, "--out", film],
        ):
            subprocess.run([sys.executable, "-m", "hil.cli", *command], check=True)


SHIPPED = {
    "failing_report": Shipped(("docs/failing_report.png",), ("hil.report.page",), failing_report, write_report),
    "turning": Shipped(("docs/turning.webp",), (), turning, make_film),
    "routed_hand": Shipped(
        ("docs/routed_hand.png",), (), routed_picture, lambda: write_picture(build_routed(), DOCS / "routed_hand.png")
    ),
    "view": Shipped(("docs/view.png",), ("hil.view.scene",), view, write_view),
}
