"""Random programs with random faults: the hand is never left closed where the board answers at all, whatever happens.

Nor does the driver return a value that the board has not sent since it was asked, or raise an undeclared error. What
breaks is shrunk to a few steps and printed as a script, `tests/support/guarded_program.py`.

A longer search: `RANDOM_PROGRAMS=1000 pytest -m slow tests/safety/test_random_programs.py -k search`.
"""

import os

import pytest
from guarded_program import GuardedProgram
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test

from aero.protocol import MAX_CODE

PROGRAMS = int(os.environ.get("RANDOM_PROGRAMS", "40"))
QUICK = {"max_examples": 6, "stateful_step_count": 10}
HOW = settings(deadline=None, suppress_health_check=list(HealthCheck), report_multiple_bugs=False, print_blob=False)

poses = st.lists(st.sampled_from([0, MAX_CODE, MAX_CODE // 2, MAX_CODE // 4]), min_size=7, max_size=7)
channels = st.integers(0, 6)
seconds = st.sampled_from([0.0, 0.05, 0.3, 1.0, 3.0])
moments = st.sampled_from([0.0, 0.007, 0.1, 0.63, 1.4, 2.9])
"""When something happens, s from now; in the middle of an exchange, of a wait, of the last opening."""
SOMETIMES = [
    f"{kind}={share}"
    for kind in (
        "reply_lost",
        "reply_byte_dropped",
        "reply_byte_doubled",
        "reply_byte_inserted",
        "reply_truncated",
        "reply_cut",
        "command_lost",
    )
    for share in (0.05, 0.3)
]
link_faults = st.sampled_from([*SOMETIMES, "reply_delayed=400", "link_slow=9600", "link_silent=1.0", "link_silent=4.0"])
"""What the driver can see; what it cannot is in docs/internals/driver.md."""
board_faults = st.sampled_from(["board_restart", "power_cycle"])
dead = st.sampled_from(["board_hangs", "servo_missing"])


class GuardedPrograms(RuleBasedStateMachine):
    program = None

    @initialize(firmware=st.sampled_from(["0.2.0", "0.1.0", "pre"]), seed=st.integers(0, 3))
    def start(self, firmware, seed):
        self.program = GuardedProgram(firmware=firmware, seed=seed)

    @rule(codes=poses, wait_s=seconds)
    def command(self, codes, wait_s):
        self.program.command(codes, wait_s)

    @rule(magnitudes=st.lists(st.sampled_from([0, 150, 400]), min_size=7, max_size=7), wait_s=seconds)
    def torques(self, magnitudes, wait_s):
        self.program.torques(magnitudes, wait_s)

    @rule(channel=channels, value=st.sampled_from([100, 500, 1000]))
    def limit_torque(self, channel, value):
        self.program.limit("torque", channel, value)

    @rule(channel=channels, value=st.sampled_from([20, 500, 32766]))
    def limit_speed(self, channel, value):
        self.program.limit("speed", channel, value)

    @rule(some=st.lists(channels, max_size=2, unique=True))
    def expect_stops(self, some):
        self.program.expect_stops(some)

    @rule(what=st.sampled_from(["codes", "currents", "temperatures", "speeds"]))
    def read(self, what):
        self.program.read(what)

    @rule(s=seconds)
    def poll(self, s):
        self.program.poll(s)

    @rule(s=st.sampled_from([0.1, 1.0, 12.0]))
    def sleep(self, s):
        self.program.sleep(s)

    @rule(s=seconds)
    def wait(self, s):
        self.program.wait(s)

    @precondition(lambda self: self.program.firmware == "0.2.0")  # others home for a minute
    @rule()
    def home(self):
        self.program.home()

    @rule()
    def resynchronise(self):
        self.program.resynchronise()

    @rule()
    def use_in_forked_process(self):
        self.program.use_in_forked_process()

    @rule(text=st.one_of(link_faults, board_faults), after_s=moments)
    def fault(self, text, after_s):
        self.program.fault(text, after_s)

    @rule(text=dead, after_s=moments)
    def die(self, text, after_s):
        self.program.fault(text, after_s)

    @rule(after_s=moments)
    def heal_link(self, after_s):
        self.program.heal_link(after_s)

    @rule(count=st.integers(1, 15), after_s=moments)
    def stray_bytes(self, count, after_s):
        self.program.stray_bytes(count, after_s)

    @precondition(lambda self: self.program.firmware != "pre")  # which has no torque mode
    @rule(after_s=moments)
    def torque_mode_of_servos(self, after_s):
        self.program.torque_mode_of_servos(after_s)

    @rule(after_s=moments)
    def unplug(self, after_s):
        self.program.unplug(after_s)

    @rule(name=st.sampled_from(["SIGINT", "SIGTERM"]), after_s=moments)
    def signal(self, name, after_s):
        self.program.signal(name, after_s)

    @precondition(lambda self: not self.program.over)
    @rule(
        how=st.sampled_from(["normally", "RuntimeError", "KeyboardInterrupt", "SystemExit", "killed"]),
        cut=st.integers(0, 15),
    )
    def end(self, how, cut):
        self.program.end(how, cut)

    def teardown(self):
        if self.program is not None and not self.program.ended:
            self.program.end()


def run(**how):
    run_state_machine_as_test(GuardedPrograms, settings=settings(HOW, **how))


def test_random_programs_leave_the_hand_open():
    run(**QUICK, derandomize=True)


@pytest.mark.slow
def test_a_search_through_random_programs_finds_no_closed_hand():
    run(max_examples=PROGRAMS, stateful_step_count=20, derandomize=True)


@pytest.mark.slow
def test_an_opening_that_does_not_open_is_found_and_shrunk_to_a_script_that_runs(monkeypatch):
    """The property can fail, and what it prints fails in the same way."""
    with monkeypatch.context() as broken:
        broken.setattr("aero.safety.guard.open_and_relax", lambda *hand, **how: None)
        with pytest.raises(AssertionError, match="the hand is left") as found:
            run(max_examples=60, stateful_step_count=3, derandomize=True, phases=[Phase.generate, Phase.shrink])
        script = next(note for note in found.value.__notes__ if note.startswith("from guarded_program"))
        print(script)
        with pytest.raises(AssertionError, match="the hand is left"):
            exec(script, {})
    exec(script, {})
    assert len(script.splitlines()) <= 6
