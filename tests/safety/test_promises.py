"""The case that comes nearest to breaking a promise of the guard, searched over programs, faults, units and timings.

The search of docs/promises.md, which writes the ten nearest cases and the smallest margins beside this file:
`PROMISE_SEARCH_S=3600 pytest -s -m slow tests/safety/test_promises.py -k search`.
"""

import json
import os
import time
from pathlib import Path
from typing import ClassVar

import pytest
from hypothesis import HealthCheck, Phase, settings, target
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test

from aero.protocol import MAX_CODE
from aero.safety import Thresholds
from hil.verdict.promises import PROMISES

pytest.importorskip("sentil", reason="the extra promises")

from promised_program import PromisedProgram

KEPT = Path(__file__).with_name("nearest_promises.json")
SEARCH_S = float(os.environ.get("PROMISE_SEARCH_S", "60"))
NEAREST = 10
HOW = settings(
    deadline=None,
    suppress_health_check=list(HealthCheck),
    report_multiple_bugs=False,
    print_blob=False,
    database=None,
    phases=[Phase.generate, Phase.target],
)
BY_NAME = {promise.name: promise for promise in PROMISES}

poses = st.lists(st.sampled_from([0, MAX_CODE, MAX_CODE // 2, MAX_CODE // 4]), min_size=7, max_size=7)
channels = st.integers(0, 6)
seconds = st.floats(0.0, 3.0).map(lambda s: round(s, 2))
moments = st.floats(0.0, 3.0).map(lambda s: round(s, 3))
labels = st.sampled_from(["thumb_abduction", "thumb_cmc_flexion", "thumb_flexor", "index", "middle", "ring", "pinky"])
kinds = st.one_of(
    st.sampled_from(["digit_jammed", "motor_dead", "gear_jammed", "cable_snapped"]),
    st.floats(0.2, 1.0).map(lambda x: f"motor_runaway={x:.2f}"),
    st.floats(55.0, 78.0).map(lambda x: f"servo_hot={x:.1f}"),
    st.floats(0.3, 0.9).map(lambda x: f"motor_weak={x:.2f}"),
    st.integers(-900, 900).map(lambda x: f"encoder_slip={x}"),
)


def placed(kind, label, at_s):
    name, _, severity = kind.partition("=")
    return f"{name}:{label}{'=' + severity if severity else ''}@{at_s}"


built_faults = st.builds(placed, kinds, labels, st.floats(1.0, 12.0).map(lambda s: round(s, 2)))
link_faults = st.one_of(
    st.sampled_from(["reply_lost", "command_lost", "reply_cut", "reply_truncated"]).flatmap(
        lambda name: st.floats(0.02, 0.5).map(lambda share: f"{name}={share:.2f}")
    ),
    st.integers(5, 900).map(lambda ms: f"reply_delayed={ms}"),
    st.floats(0.2, 4.0).map(lambda s: f"link_silent={s:.2f}"),
)


class Promises(RuleBasedStateMachine):
    """Programs that do what programs do; each ends with all its margins."""

    program = None
    found: ClassVar = []
    """(share of a comfortable margin, promise, margin, script) of every program, of the whole search."""

    @initialize(
        firmware=st.sampled_from(["0.2.0", "0.1.0", "pre"]),
        unit=st.one_of(st.just("reference"), st.integers(0, 40).map(lambda seed: f"plausible:{seed}")),
        faults=st.lists(built_faults, max_size=1),
        seed=st.integers(0, 9),
    )
    def start(self, firmware, unit, faults, seed):
        self.program = PromisedProgram(firmware=firmware, unit=unit, faults=faults, seed=seed)

    @rule(codes=poses, wait_s=seconds)
    def command(self, codes, wait_s):
        self.program.command(codes, wait_s)

    @rule(channel=channels, share=st.floats(0.0, 1.0), wait_s=seconds)
    def command_one(self, channel, share, wait_s):
        codes = [0] * 7
        codes[channel] = round(share * MAX_CODE)
        self.program.command(codes, wait_s)

    @rule(channel=channels, value=st.integers(100, 1000))
    def limit_torque(self, channel, value):
        self.program.limit("torque", channel, value)

    @rule(channel=channels, value=st.integers(20, 3000))
    def limit_speed(self, channel, value):
        self.program.limit("speed", channel, value)

    @rule(some=st.lists(channels, max_size=2, unique=True))
    def expect_stops(self, some):
        self.program.expect_stops(some)

    @rule(s=seconds)
    def poll(self, s):
        self.program.poll(s)

    @rule(s=seconds)
    def wait(self, s):
        self.program.wait(s)

    @rule()
    def resynchronise(self):
        self.program.resynchronise()

    @rule(text=st.one_of(link_faults, st.sampled_from(["board_restart", "power_cycle"])), after_s=moments)
    def fault(self, text, after_s):
        self.program.fault(text, after_s)

    @rule(text=st.sampled_from(["board_hangs", "servo_missing"]), after_s=moments)
    def die(self, text, after_s):
        self.program.fault(text, after_s)

    @rule(after_s=moments)
    def heal_link(self, after_s):
        self.program.heal_link(after_s)

    @precondition(lambda self: not self.program.over)
    @rule(how=st.sampled_from(["normally", "RuntimeError", "killed"]))
    def end(self, how):
        self.program.end(how)

    def teardown(self):
        if self.program is None:
            return
        if not self.program.ended:
            self.program.end()
        for name, margin in self.program.margins.items():
            if margin.tested:
                target(-margin.share, label=name)
                self.found.append((margin.share, name, margin.value, self.program.script()))


def search(seconds, seed, examples=25):
    """Search for some s of processor time, one seed after another; return how many. What breaks a promise is raised."""
    until, first = time.process_time() + seconds, seed
    while time.process_time() < until:
        Promises._hypothesis_internal_use_seed = seed
        run_state_machine_as_test(Promises, settings=settings(HOW, max_examples=examples, stateful_step_count=8))
        seed += 1
    return seed - first


def nearest(found):
    """Return the smallest margin of each promise, and the ten nearest cases, at most three of a promise."""
    smallest, cases = {}, []
    for share, name, value, script in sorted(found):
        smallest.setdefault(name, value)
        if sum(case["promise"] == name for case in cases) < 3 and len(cases) < NEAREST:
            cases.append({"promise": name, "margin": value, "share": share, "script": script.splitlines()})
    return smallest, cases


@pytest.mark.slow
def test_a_search_finds_no_broken_promise():
    Promises.found = []
    first = int(time.time()) % 1_000_000
    seeds = search(SEARCH_S, first)
    smallest, cases = nearest(Promises.found)
    content = {
        "hours": round(SEARCH_S / 3600, 2),
        "seeds": [first, first + seeds - 1],
        "programs": len({script for *_, script in Promises.found}),
        "smallest": {name: round(value, 5) for name, value in smallest.items()},
        "cases": cases,
    }
    KEPT.write_text(json.dumps(content, indent=1) + "\n")
    for case in cases:
        print(f"{case['promise']}: {case['margin']:.4g} {BY_NAME[case['promise']].unit}")
        print("\n".join(case["script"]))
    print(content["programs"], "programs", content["seeds"], content["smallest"])


@pytest.mark.slow
@pytest.mark.parametrize("bound", ["current_s", "stray_s", "stale_s"])
def test_a_bound_of_the_guard_that_is_doubled_is_found(bound, monkeypatch):
    """Within ten minutes of one processor; the guard's own number is changed, and the promise's is not."""

    class Doubled(Thresholds):
        def __init__(self):
            super().__init__(**{bound: 2.0 * getattr(Thresholds(), bound)})

    monkeypatch.setattr("guarded_program.Thresholds", Doubled)
    begin = time.process_time()
    with pytest.raises(AssertionError, match=r"promise \w+ is broken by") as broken:
        search(600.0, 1)
    print(f"{bound} doubled: {broken.value} after {time.process_time() - begin:.0f} s")
    print(next(note for note in broken.value.__notes__ if note.startswith("from promised_program")))


def kept():
    return json.loads(KEPT.read_text())["cases"] if KEPT.exists() else []


@pytest.mark.parametrize("case", kept(), ids=lambda case: f"{case['promise']} {case['margin']:.4g}")
def test_the_nearest_cases_break_no_promise(case):
    """The ten nearest of the last search; no margin is half of what it was."""
    found = {}
    exec("\n".join(case["script"]), found)
    assert found["program"].margins[case["promise"]].value > 0.5 * case["margin"]
