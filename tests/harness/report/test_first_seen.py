"""A fault that begins in the run has its time; one that was there before has none."""

from dataclasses import replace

from synthetic import held

from hil.report.evidence import first_seen, start_times
from hil.targets.wire_log import WireRecord
from hil.verdict.findings import Finding
from hil.verdict.judged_run import Result, Validation
from hil.verdict.run_end import FINISHED

BAD = Finding("holding_current", "ring", False, "2.2 A", "at most 1.5 A", "test", "Friction.", "Free it.")
GOOD = replace(BAD, passed=True)


def recording(name, begins_s, *writes):
    made = held(name, [[0] * 7, [9000] * 7], 1.0)
    wire = tuple(WireRecord(begins_s + 0.1 * i, "to_hand", bytes([byte])) for i, byte in enumerate(writes))
    return replace(made, header=replace(made.header, limits="aero_hand_open", duration_s=2.0), wire=wire)


AUDIT, HOLDING = recording("audit", 0.0, 1, 2, 3), recording("holding", 0.0, 1, 2, 4)
WHOLE = replace(AUDIT, wire=(*recording("", 10.0, 1, 2, 3).wire, *recording("", 15.0, 1, 2, 4).wire))
CALM = {"audit": {"ring": {"pull": 0.5, "followed": 97.5}}, "holding": {}}


def run(audit=GOOD, holding=BAD):
    # In the order of their names, as `aero-hil report FOLDER/*.mcap` gives them.
    results = {
        "holding": Result(HOLDING, CALM["holding"], (holding,)),
        "audit": Result(AUDIT, CALM["audit"], (audit,)),
    }
    return Validation(results, FINISHED, 1.0, whole_run=Result(WHOLE, {}, ()))


def test_experiments_are_found_in_the_bytes_of_the_run():
    assert start_times(WHOLE, [AUDIT, HOLDING]) == {"audit": 10.0, "holding": 15.0}
    assert start_times(WHOLE, [recording("replay", 0.0, 9)]) == {}


def test_what_is_off_later_is_told_from_when_it_was_seen():
    found = first_seen(run())
    assert (found.experiment, found.seen_s, found.passed_until_s) == ("holding", 16.0, 12.0)
    assert found.sentence == "from 16 s after the start on, in holding; every check before passed"


def test_what_is_off_from_the_start_has_no_time():
    assert first_seen(run(audit=BAD)) is None
    assert first_seen(run(holding=GOOD)) is None
