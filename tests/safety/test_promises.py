"""What the guard promises, read from the bytes: how soon it opens a hand, that it starts gently, that it ends.

The search through programs, faults, units and timings: `PROMISE_SEED=1 PROMISE_PROGRAMS=10000 pytest -m slow
tests/safety/test_promises.py`. Its seed is fixed, so it decides the same on every machine.
"""

import os

import pytest
from hypothesis import HealthCheck, seed, settings
from hypothesis import Phase as Stage
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test
from promised_program import PromisedProgram

from aero.protocol import MAX_CODE
from aero.safety import Thresholds
from hil.emulated.faults import CATALOGUE

PROGRAMS = int(os.environ.get("PROMISE_PROGRAMS", "50"))
SEED = int(os.environ.get("PROMISE_SEED", "0"))
HOW = settings(
    deadline=None,
    suppress_health_check=list(HealthCheck),
    report_multiple_bugs=False,
    print_blob=False,
    database=None,
    phases=[Stage.generate],
)

poses = st.lists(st.sampled_from([0, MAX_CODE, MAX_CODE // 2, MAX_CODE // 4]), min_size=7, max_size=7)
channels = st.integers(0, 6)
seconds = st.floats(0.0, 3.0).map(lambda s: round(s, 2))
moments = st.floats(0.0, 3.0).map(lambda s: round(s, 3))
kinds = st.one_of(
    st.sampled_from(["digit_jammed", "motor_dead", "gear_jammed", "cable_snapped"]),
    st.floats(0.2, 1.0).map(lambda x: f"motor_runaway={x:.2f}"),
    st.floats(55.0, 78.0).map(lambda x: f"servo_hot={x:.1f}"),
    st.floats(0.3, 0.9).map(lambda x: f"motor_weak={x:.2f}"),
    st.integers(-900, 900).map(lambda x: f"encoder_slip={x}"),
)


def placed(kind):
    """Return faults of a kind on one of the channels that can have it."""
    name, equals, severity = kind.partition("=")
    labels = st.sampled_from([channel.label for channel in CATALOGUE[name].channels])
    at_s = st.floats(1.0, 12.0).map(lambda s: round(s, 2))
    return st.builds(lambda label, at_s: f"{name}:{label}{equals}{severity}@{at_s}", labels, at_s)


built_faults = kinds.flatmap(placed)
link_faults = st.one_of(
    st.sampled_from(["reply_lost", "command_lost", "reply_cut", "reply_truncated"]).flatmap(
        lambda name: st.floats(0.02, 0.5).map(lambda share: f"{name}={share:.2f}")
    ),
    st.integers(5, 900).map(lambda ms: f"reply_delayed={ms}"),
    st.floats(0.2, 4.0).map(lambda s: f"link_silent={s:.2f}"),
)


class Promises(RuleBasedStateMachine):
    """Programs that do what programs do; the end of each says which promises it broke."""

    program = None

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
        if self.program is not None and not self.program.ended:
            self.program.end()


@pytest.mark.slow
def test_a_search_finds_no_broken_promise():
    seed(SEED)(Promises)
    run_state_machine_as_test(Promises, settings=settings(HOW, max_examples=PROGRAMS, stateful_step_count=8))


FIST = [MAX_CODE] * 4 + [0] * 3
PROVOKED = {
    "current_s": ("current", ["digit_jammed:index@4.0"], None),
    "stray_s": ("short", ["motor_dead:ring@4.0"], None),
    "stale_s": ("stale", [], "servo_missing"),
    "temperature_look_s": ("temperatures", [], None),
    "silent_s": ("silence", [], "board_hangs"),
}
"""What breaks a threshold: the promise that is about it, a fault that the hand is built with, or one of its board."""


def provoke(faults, later):
    """Close the fingers of a hand with a fault until the guard stops it."""
    program = PromisedProgram(firmware="0.2.0", faults=faults, late_s=0.05)
    program.command(FIST, 0.5)
    if later:
        program.fault(later, 0.0)
    for _ in range(4):
        program.command([0] * 7, 1.0)
        program.command(FIST, 3.0)
    program.end()


@pytest.mark.parametrize("bound", PROVOKED)
def test_a_bound_of_the_guard_that_is_doubled_is_found(bound, monkeypatch):
    """The guard's own number is changed, and the promise's is not."""
    name, faults, later = PROVOKED[bound]
    provoke(faults, later)

    class Doubled(Thresholds):
        def __init__(self):
            super().__init__(**{bound: 2.0 * getattr(Thresholds(), bound)})

    monkeypatch.setattr("guarded_program.Thresholds", Doubled)
    with pytest.raises(AssertionError, match=f"promises are broken.*{name}"):
        provoke(faults, later)
