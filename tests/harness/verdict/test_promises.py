"""The guard's promises as formulas: what they say, what a recording's margin is, and that it can be below zero."""

import dataclasses

import numpy as np
import pytest
from click.testing import CliRunner

from hil import open_target
from hil.cli import main
from hil.recordings.mcap_file import write_recording
from hil.targets.wire_log import WireRecord
from hil.verdict.promise_signals import events, signals
from hil.verdict.promises import PROMISES, STEP_S, YES
from hil.verdict.validation import validate

pytest.importorskip("sentil", reason="the extra promises")

from hil.verdict.margins import margin, margins

BY_NAME = {promise.name: promise for promise in PROMISES}


def at(seconds, **values):
    """Times, and signals that have a value from one time on: `current=[(0.0, 1.0), (2.0, 5.0)]`."""
    times = np.arange(0.0, seconds, STEP_S)
    steps = {"moving": [(0.0, YES)], "fresh": [(0.0, YES)]} | values
    return times, {
        name: np.select([times >= t for t, _ in reversed(pairs)], [value for _, value in reversed(pairs)])
        for name, pairs in steps.items()
    }


@pytest.mark.parametrize(
    ("name", "quiet", "over", "bound", "within_s"),
    [
        ("current", 1.0, 4.6, 4.0, 0.5),
        ("temperature", 30.0, 70.0, 65.0, 1.3),
        ("beyond", 0.0, 0.2, 0.15, 0.4),
        ("short", 0.0, 0.7, 0.5, 0.4),
    ],
)
def test_too_much_for_longer_than_the_guard_may_take_breaks_a_promise(name, quiet, over, bound, within_s):
    """The bounds of docs/safety.md and the time of a look; the margin is in the unit of the quantity."""
    for held_s, expected in ((within_s - 0.1, bound - quiet), (within_s + 0.1, bound - over)):
        times, values = at(6.0, **{name: [(0.0, quiet), (2.0, over), (2.0 + held_s, quiet)]})
        assert margin(BY_NAME[name], times, values).value == pytest.approx(expected)
    times, values = at(6.0, **{name: [(0.0, over)], "moving": [(0.0, -YES)]})
    assert not margin(BY_NAME[name], times, values).tested


@pytest.mark.parametrize(("name", "bound"), [("silence", 2.5), ("stale", 0.5)])
def test_what_lasts_has_its_margin_in_seconds(name, bound):
    times, values = at(6.0, **{name: [(0.0, 0.0), (2.0, 0.3)]})
    assert margin(BY_NAME[name], times, values).value == pytest.approx(bound - 0.3)
    times, values = at(6.0, **{name: [(0.0, 0.0), (2.0, 3.0)]})
    assert margin(BY_NAME[name], times, values).value == pytest.approx(bound - 3.0)


@pytest.mark.parametrize(
    ("name", "values", "expected"),
    [
        ("gentle", {"gentle": [(0.0, YES)], "step": [(0.0, 0.01)]}, 0.0005),
        ("asked", {"unasked": [(0.0, 0.0), (1.0, 1.0)]}, -0.5),
        ("ending", {"left": [(0.0, 0.0), (1.0, 7.0)]}, 18.0),
        ("open", {"ended": [(0.0, -YES), (1.0, YES)], "bent": [(0.0, 20.0)], "told": [(0.0, -YES)]}, 5.0),
    ],
)
def test_what_a_test_alone_can_see(name, values, expected):
    assert margin(BY_NAME[name], *at(2.0, **values)).value == pytest.approx(expected)


def test_every_promise_speaks_of_signals_that_there_are():
    known = {*signals((), 1.0)[1], "moving"}
    for promise in PROMISES:
        assert not promise.recorded or known.issuperset(promise.signals)


def frame(opcode, *words):
    return bytes((opcode, 0)) + np.array([*words, *[0] * (7 - len(words))], "<u2").tobytes()


def test_signals_are_told_from_the_bytes():
    """A command, a reading of positions in two pieces, and one of currents that is never answered."""
    wire = [
        WireRecord(0.0, "to_hand", frame(0x11, *[0] * 7)),
        WireRecord(3.0, "to_hand", frame(0x22)),
        WireRecord(3.01, "from_hand", b"\x7f" + frame(0x22, 6554)[:5]),
        WireRecord(3.02, "from_hand", frame(0x22, 6554)[5:]),
        WireRecord(3.04, "to_hand", frame(0x24)),
    ]
    assert [(t, what) for t, what, _ in events(wire)] == [
        (0.0, "command"), (3.0, "asked"), (3.02, "answered"), (3.02, "positions"), (3.04, "asked"),
    ]  # fmt: skip
    times, found = signals(wire, 4.0)
    assert found["beyond"][-1] == pytest.approx(0.1, abs=1e-4)
    assert found["short"][-1] == pytest.approx(0.0)
    assert found["silence"][-1] == pytest.approx(0.96)
    assert times[-1] == pytest.approx(4.0)


@pytest.fixture(scope="module")
def guarded():
    with open_target(seed=3, guarded=True) as target:
        return validate(target, ("audit",)).results["audit"].recording


def test_a_healthy_guarded_hand_leaves_margins(guarded):
    found = {one.promise.name: one for one in margins(guarded)}
    assert list(found) == [promise.name for promise in PROMISES if promise.recorded]
    assert all(one.value > 0 for one in found.values())
    assert found["current"].value == pytest.approx(2.9, abs=0.3)
    assert margins(dataclasses.replace(guarded, header=dataclasses.replace(guarded.header, safety={}))) == ()


def test_the_report_shows_what_is_left(guarded, tmp_path):
    write_recording(guarded, tmp_path / "audit.mcap")
    result = CliRunner().invoke(main, ["report", str(tmp_path / "audit.mcap"), "--out", str(tmp_path / "r.html")])
    assert result.exit_code == 0, result.output
    assert "the guard's promise that came nearest to being broken: stale, 0.4" in result.output
    page = (tmp_path / "r.html").read_text()
    assert "Margins of the guard" in page
    assert BY_NAME["current"].words in page
