"""A case is gone through alike by terminal, page and tests: an emulated hand, a board that homes, answers that stay."""

from contextlib import closing, contextmanager
from dataclasses import replace

import pytest
from click.testing import CliRunner

from aero.channels import Channel
from aero.exit_code import Exit
from aero.safety import SafetyReason, SafetyStopError
from hil.cli import main
from hil.dialogue import case_session
from hil.dialogue.asker import Choice
from hil.dialogue.case_session import CONNECTED, RUNS, CaseSession
from hil.emulated.any_hand import open_target
from hil.emulated.emulated_case import ACTS, EmulatedCaseHand
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults import parse_fault
from hil.targets.hand_errors import NoHandError
from hil.targets.hand_spec import PortSpec
from hil.verdict.case import DiagnosisCase, Done
from hil.verdict.case_file import HandOfCase, StoredCase, read_case, write_case
from hil.verdict.failures import Failures
from hil.verdict.group import AmbiguityGroup, Proposal
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import EndKind, RunEnd
from hil.verdict.steps import StepOutcome, steps
from hil.verdict.validation import validate

BY_HELP = "n\nm\n" * 40
"""No to each question, and each step by the program."""
OFF = Failures({("presence", "round_trip", "hand"): 9.0, ("presence", "idle_current", "ring"): 3.0})
SETUP = StoredCase(
    DiagnosisCase((AmbiguityGroup(OFF, frozenset({Suspect(Part.SETUP)})),), ("presence",), ("presence",)),
    HandOfCase("0.2.0", "right"),
)


class Silent:
    """Answers yes, and keeps what it is shown."""

    def __init__(self, connected=True):
        self.asked, self.told, self.doing, self.announced, self._connected = [], [], [], [], connected

    def ask(self, question):
        self.asked.append(question.text)
        if isinstance(question, Choice) and question.text == CONNECTED:
            return self._connected
        return question.options[0].answer if isinstance(question, Choice) else ""

    def show(self, case):
        self.told.append(case)

    def announce(self, motion):
        self.announced.append(motion)

    def follow(self, target):
        """Look on."""

    def progress(self, part, doing, left_s):
        self.doing.append((part, doing, left_s))

    def tell(self, text):
        self.told.append(text)


class Homing:
    """A hand whose board answers only after a while."""

    spec, helper = PortSpec("/dev/nowhere"), None

    def __init__(self, target, silent_s):
        self.target, self.clock = target, target.clock
        self.answers_at, self.opened = self.clock.now() + silent_s, 0

    @contextmanager
    def open(self, *, may_be_silent=False):
        if self.clock.now() < self.answers_at:
            raise NoHandError("no hand answers")
        self.opened += 1
        yield self.target


@pytest.mark.parametrize(("silent_s", "found"), [(9, True), (45, True), (120, False)])
def test_a_board_that_homes_is_waited_for(silent_s, found, tmp_path):
    """Enter 9 s after power returned ended with 3 once, and lost what had been typed."""
    write_case(tmp_path, SETUP)
    with open_target(homed=True) as target:
        session = CaseSession(SETUP, tmp_path, Homing(target, silent_s), asker := Silent(connected=False))
        if not found:
            with pytest.raises(NoHandError):
                session.go_through()
            assert read_case(tmp_path).case.done
            return
        session.go_through()
    assert session.case.gone
    parts = [part for part, *_ in asker.doing]
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    left = [left_s for _, doing, left_s in asker.doing if "board" not in doing]
    assert left == sorted(left, reverse=True)


def test_a_board_that_waits_for_the_rest_of_a_frame_gets_it(tmp_path):
    """A board that another program had left out of step kept a step from ending any failure."""
    lost = AmbiguityGroup(Failures({("session", "lost_replies", "hand"): 3.0}), frozenset({Suspect(Part.SETUP)}))
    once = replace(SETUP, case=replace(SETUP.case, opened=(lost,)))
    write_case(tmp_path, once)
    with closing(EmulatedCaseHand(EmulatedSpec())) as standing:
        standing.electronics.board.receive(b"M105\n")
        session = CaseSession(once, tmp_path, standing, asker := Silent())
        session.go_through()
    (done,) = session.case.done
    assert (done.proposal.step.name, done.outcomes) == ("again", (StepOutcome.GONE,))
    assert any("rest of a command" in one for one in asker.told if isinstance(one, str))


def test_a_part_is_replaced_until_the_next_step(tmp_path):
    """A board that homed was asked a second time from the old computer, which was then cleared."""
    stalls = parse_fault("host_stalls=0.5")
    with closing(EmulatedCaseHand(EmulatedSpec(faults=(stalls,)))) as hand:
        hand.do(Proposal(steps()["computer"]))
        for _ in range(2):
            with hand.open():
                assert f"inject {stalls}" not in hand.workbench.acts_present
        hand.do(Proposal(steps()["again"]))
        assert f"inject {stalls}" in hand.workbench.acts_present


def test_a_hand_that_no_step_lets_answer_still_fails(tmp_path):
    """A case of two servos with one ID ended with exit code 3, for its board answers no more after a restart."""
    write_case(tmp_path, SETUP)
    with open_target(homed=True) as target:
        session = CaseSession(SETUP, tmp_path, Homing(target, 1e6), Silent())
        session.go_through()
    outcomes = {done.outcomes for done in session.case.done if done.proposal.step.runs}
    assert outcomes == {(StepOutcome.STAYS,)}


def test_a_run_that_stays_inconclusive_says_nothing_and_repeats_no_act(tmp_path, monkeypatch):
    """A servo that earlier runs had heated up stopped each run after a step, and the good digit was convicted."""
    with open_target(homed=True) as target:
        good = validate(target, ("presence",))
    hot = RunEnd(
        EndKind.STOPPED,
        "presence",
        "the ring finger is hot.",
        SafetyStopError("hot", SafetyReason.TEMPERATURE, Channel.RING),
    )
    runs = []

    def stopped(target, case, proposal, **_more):
        runs.append(target.clock.now())
        return (StepOutcome.STAYS,), replace(good, end=hot)

    monkeypatch.setattr(case_session, "COOLS_S", 20.0)
    monkeypatch.setattr(case_session, "rerun", stopped)
    write_case(tmp_path, SETUP)
    with open_target(homed=True) as target:
        session = CaseSession(SETUP, tmp_path, Homing(target, 0), asker := Silent())
        session.go_through()
    assert {done.outcomes for done in session.case.done if done.proposal.step.runs} == {(StepOutcome.UNSURE,)}
    assert len(runs) == RUNS * len(asker.announced)
    repeated = {text for text in asker.asked if "inconclusive" in text}
    assert repeated == {"The run is inconclusive. The ring finger is hot. Ready to repeat it."}
    assert runs[1] - runs[0] >= 20.0


def exchanged(tmp_path, monkeypatch):
    """Return the session of a case of the middle finger whose failure has gone along with the servo."""
    with open_target(homed=True) as target:
        good = validate(target, ("presence",))
    monkeypatch.setattr(case_session, "rerun", lambda *_, **__: ((StepOutcome.MOVED,), good))
    off = Failures({("audit", "followed", "middle"): -9.0})
    middle = AmbiguityGroup(off, frozenset({Suspect(part, Channel.MIDDLE) for part in (Part.SERVO, Part.DIGIT)}))
    at_middle = ("home", None), ("inspect", Channel.MIDDLE), ("bend", Channel.MIDDLE)
    done = tuple(Done(Proposal(steps()[name], at), (StepOutcome.UNSURE,)) for name, at in (("again", None), *at_middle))
    write_case(tmp_path, stored := replace(SETUP, case=DiagnosisCase((middle,), ("audit",), ("audit",), done)))
    with open_target(homed=True) as target:
        # the first digit, the index finger, has the marked servo, and moves when the middle finger is nudged
        session = CaseSession(stored, tmp_path, Homing(target, 0), Silent())
        session.go_through()
    return session


def test_a_failure_that_goes_along_with_servos_that_kept_their_ids_convicts_none(tmp_path, monkeypatch):
    """Another servo pulls the bad digit under its own ID: the failure went along, and the good servo was convicted."""
    session = exchanged(tmp_path, monkeypatch)
    (exchange,) = (one for one in session.case.done if one.proposal.step.name == "exchange")
    assert exchange.outcomes == (StepOutcome.UNSURE,)
    assert exchange.note == case_session.KEPT_IDS
    assert not session.case.told


@pytest.mark.parametrize(("channel", "outcome"), [("INDEX", StepOutcome.MOVED), ("RING", StepOutcome.UNSURE)])
def test_an_exchange_is_shown_by_a_stop_at_the_digit_that_got_the_servo(tmp_path, monkeypatch, channel, outcome):
    """A dead servo held that digit closed, nothing could be nudged, and the case went on to buy a board."""

    def refuse(*_):
        raise SafetyStopError("still 38% closed", SafetyReason.STILL_CLOSED, Channel[channel])

    monkeypatch.setattr(case_session, "nudge", refuse)
    session = exchanged(tmp_path, monkeypatch)
    (exchange,) = (one for one in session.case.done if one.proposal.step.name == "exchange")
    assert exchange.outcomes == (outcome,)


def test_a_board_that_has_just_booted_is_asked_over_a_new_link(tmp_path):
    write_case(tmp_path, SETUP)
    with open_target(homed=True) as target:
        hand = Homing(target, 9)
        CaseSession(SETUP, tmp_path, hand, Silent()).go_through()
    assert hand.opened == 2


@pytest.mark.parametrize(
    ("ended", "command"),
    [
        ("version", "aero-hil validate --hil /dev/nowhere --firmware VERSION --side SIDE"),
        ("home", "aero-hil validate --hil /dev/nowhere --firmware 0.1.5 --side left"),
    ],
)
def test_a_case_ends_with_a_command_that_names_version_and_side(ended, command, tmp_path):
    """A left hand with 0.1.5 was to be validated as a right one with the default version."""
    skipped = Done(Proposal(steps()["flash"]), (StepOutcome.SKIPPED,))
    done = {
        "version": (Done(Proposal(steps()["version"]), (StepOutcome.YES,)), skipped),
        "home": (Done(Proposal(steps()["home"]), (StepOutcome.FREED,)),),
    }
    closed = replace(SETUP, case=replace(SETUP.case, done=done[ended]))
    write_case(tmp_path, closed)
    with open_target() as target:
        hand = Homing(target, 0)
        hand.spec = PortSpec("/dev/nowhere", "0.1.5", "left")
        CaseSession(closed, tmp_path, hand, asker := Silent()).go_through()
    assert asker.told[-1].conclusion.endswith(f" Then validate again: {command}")


@pytest.mark.slow
def test_a_newcomer_sees_a_whole_case_on_the_emulated_hand_of_the_run(tmp_path):
    run = ["--only", "presence", "--only", "audit", "--fault", "motor_dead:ring", "--out", str(tmp_path)]
    CliRunner().invoke(main, ["validate", *run])
    put_down = CliRunner().invoke(main, ["diagnose", str(tmp_path)], input="n\nn\nm\nn\nm\n")
    assert "the same command resumes" in put_down.output
    assert len(read_case(tmp_path).case.done) == 1
    ended = CliRunner().invoke(main, ["diagnose", str(tmp_path)], input=BY_HELP)
    assert ended.exit_code == Exit.OUT_OF_LIMITS
    case = read_case(tmp_path).case
    assert case.told == (Suspect(Part.SERVO, Channel.RING),)
    assert case.done[-1].outcomes == (StepOutcome.MOVED,)
    assert "exchanged the servos of ring and middle" in ended.output


def test_a_hand_on_a_port_is_not_emulated(tmp_path):
    write_case(tmp_path, SETUP)
    ended = CliRunner().invoke(main, ["diagnose", str(tmp_path)])
    assert ended.exit_code == Exit.USAGE
    assert "give it with --hil" in ended.output


def test_every_step_can_be_done_for_a_newcomer():
    assert ACTS.keys() == {name for name, step in steps().items() if step.runs}
