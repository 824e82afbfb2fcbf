"""A driver or map with a mistake is told from a hand with a fault: each mistake is put in, the hand is a good one."""

import numpy as np
import pytest
from drawn import drawn
from driver_mistakes import GENTLE, MAPPED, MISTAKES, MISTAKES_OF_THE_MAP

from aero.actuation import ActuationMap
from aero.driver import AeroHand
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.verdict.findings import failed
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import EndKind
from hil.verdict.validation import validate
from model.units.conditions import Conditions


def blamed(experiments, **named):
    """Return the checks of `driver` that fail on a good hand."""
    with open_target(unit="reference", **named) as target:
        done = validate(target, experiments)
    return set() if done.driver is None else {finding.check for finding in failed(done.driver.findings)}


@pytest.mark.parametrize(
    ("hand", "firmware", "guarded"),
    drawn([("right", "0.2.0", True), ("left", "0.2.0", False), ("left", "pre", True)], 1),
)
def test_a_good_driver_is_not_blamed(hand, firmware, guarded):
    assert blamed(("presence", "audit", "replay"), side=hand, firmware=firmware, guarded=guarded) == set()


@pytest.mark.parametrize(
    "fault", drawn(["reply_doubled=0.3", "reply_reordered=0.3", "link_slow=9600", "command_delayed=400"], 1)
)
def test_a_good_driver_on_a_bad_link_is_not_blamed(fault):
    assert blamed(("presence", "audit", "response"), faults=[parse_fault(fault)], guarded=True, seed=3) == set()


def test_a_good_driver_on_a_late_host_is_not_blamed():
    """As on any physical port, where a reading takes its time."""
    assert blamed(("presence", "audit"), conditions=Conditions(late_s=0.01)) == set()


@pytest.mark.parametrize("mistake", drawn(MISTAKES.values(), 6), ids=MISTAKES)
def test_a_mistake_of_the_driver_is_found_in_the_bytes(mistake, monkeypatch):
    mistake(monkeypatch)
    assert blamed(GENTLE)


@pytest.mark.parametrize("name", drawn(["sends index and middle exchanged", "reads index and ring exchanged"], 1))
def test_a_mistake_for_which_the_guard_stops_is_the_drivers(name, monkeypatch):
    MISTAKES[name](monkeypatch)
    with open_target(unit="reference", guarded=True) as target:
        done = validate(target, GENTLE)
    assert done.end.kind is EndKind.STOPPED
    assert done.diagnosis.suspects == (Suspect(Part.DRIVER),)


def test_a_good_driver_whose_hand_the_guard_stops_is_not_blamed():
    with open_target(unit="reference", guarded=True, faults=[parse_fault("gear_jammed:ring")]) as target:
        done = validate(target, GENTLE)
    assert done.end.kind is EndKind.STOPPED
    assert done.end.cut
    assert failed(done.driver.findings) == ()


@pytest.mark.parametrize("mistake", drawn(MISTAKES_OF_THE_MAP.values(), 2), ids=MISTAKES_OF_THE_MAP)
def test_a_mistake_of_the_map_is_found_in_the_bytes(mistake, monkeypatch):
    mistake(monkeypatch)
    assert blamed(MAPPED)


@pytest.mark.parametrize("guarded", [False, True])
def test_a_driver_that_returns_an_earlier_reading_is_named(guarded, monkeypatch):
    """It once ended a run as a defect of aero-hil, for the time of its readings lay before the run."""
    real, kept = AeroHand.read_codes, {"at": -np.inf}

    def cached(self):
        now = self._clock.now()
        if now - kept["at"] > 0.025:
            kept.update(at=now, codes=real(self))
        return kept["codes"].copy()

    monkeypatch.setattr(AeroHand, "read_codes", cached)
    with open_target(unit="reference", guarded=guarded) as target:
        done = validate(target, (*GENTLE, "response"))
    assert done.diagnosis.suspects == (Suspect(Part.DRIVER),)
    assert "unasked" in {finding.check for finding in failed(done.driver.findings)}


def test_a_map_that_wraps_beyond_its_windows_is_named(monkeypatch):
    """No validation moves beyond a window: it passed with a map that turns a hand the other way."""
    real = ActuationMap.saturating_codes

    def wrapping(self, angles):
        low, high = self.window_rad.T
        codes = np.rint((np.asarray(angles) - low) / (high - low) * 65535).astype(np.int64) % 65536
        return real(self, angles)._replace(codes=codes.astype(np.uint16))

    monkeypatch.setattr(ActuationMap, "saturating_codes", wrapping)
    with open_target(unit="reference") as target:
        done = validate(target, GENTLE)
    assert done.diagnosis.suspects == (Suspect(Part.DRIVER),)
    assert {finding.check for finding in failed(done.driver.findings)} == {"unclipped"}
