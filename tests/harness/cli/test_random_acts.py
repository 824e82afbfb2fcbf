"""Random acts and malformed lines on a served hand: each is done or refused in a sentence, and none ends `emulate`."""

import random
import select
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import NIGHTLY

from aero.channels import Channel
from firmware_emulator.links import pty
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults import CATALOGUE
from hil.emulated.faults.acts import ACTS
from hil.emulated.hands_on import COMMAND, HandsOn
from hil.verdict.part import Part
from model.units import load_unit

NUMBERS = ("0", "40", "100", "-5", "nan", "inf", "1e300", "1e-300", "mild", "severe", "fast", "")
STRAY = ("50", "x", "\ud800", "é\x1b[2J", "\0", "ring ring ring")
TURNS_S = (0.001, 0.01, 0.05, 0.3)


def a_fault(chance):
    fault = chance.choice(list(CATALOGUE.values()))
    bounds = [] if fault.severity is None else [str(fault.severity.low), str(fault.severity.high)]
    where = f":{chance.choice(fault.channels or list(Channel)).label}" if chance.random() < 0.8 else ""
    how_much = f"={chance.choice([*NUMBERS, *bounds, *bounds])}" if chance.random() < 0.7 else ""
    return f"{fault.name}{where}{how_much}"


WORDS = {
    "FAULT": a_fault,
    "CHANNEL": lambda chance: chance.choice(list(Channel)).label,
    "PART": lambda chance: chance.choice(list(Part)).name.lower(),
    "PERCENT": lambda chance: chance.choice([*NUMBERS, f"{chance.uniform(0, 100):.1f}"]),
}
TAKES = {**{name: one.takes for name, one in ACTS.items()}, COMMAND: ("CHANNEL", "PERCENT"), "help": (), "dance": ()}


def a_line(chance):
    """Return words of the prompt, one in six with a word too few or too many."""
    name = chance.choice([*TAKES, COMMAND, COMMAND])
    words = [name, *(WORDS[kind.strip("[]")](chance) for kind in TAKES[name])]
    if chance.random() < 0.1:
        words.pop(chance.randrange(len(words)))
    if chance.random() < 0.1:
        words.append(chance.choice(STRAY))
    return " ".join(words)


def walk(seed, lines, monkeypatch):
    """Serve a hand on a clock of the test's own, and do random lines to it, several in one turn."""
    chance, now, said, done = random.Random(seed), [0.0], [], []
    monkeypatch.setattr(pty, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(pty, "select", SimpleNamespace(select=lambda *ends: select.select(*ends[:3], 0.0)))
    electronics, workbench = build_emulated(load_unit("reference"), EmulatedSpec(seed=seed))
    workbench.at_a_port = electronics.says_rom_text = True
    hands_on = HandsOn(workbench, lambda text, severity: said.append(text))

    def turn():
        for _ in range(chance.choice([0, 1, 1, 3])):
            done.append(a_line(chance))
            hands_on.put(done[-1])
        hands_on.serve()
        now[0] += chance.choice(TURNS_S)
        return len(done) >= lines

    with pty.PtyServer(electronics) as server:
        try:
            server.run(turn)
        except Exception as error:
            raise AssertionError("\n".join(done)) from error
    assert np.isfinite(workbench.mechanics.joint_angles()).all(), "\n".join(done)
    assert all(said)


@given(st.integers(0, 10_000))
@settings(max_examples=4, deadline=None)
def test_random_acts_end_no_emulator(seed):
    with pytest.MonkeyPatch.context() as monkeypatch:
        walk(seed, 60, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(50 if NIGHTLY else 10))
def test_a_thousand_random_acts_end_no_emulator(seed, monkeypatch):
    walk(seed, 1000, monkeypatch)


def test_every_severity_has_bounds():
    assert all(np.isfinite(fault.severity.high) for fault in CATALOGUE.values() if fault.severity is not None)
