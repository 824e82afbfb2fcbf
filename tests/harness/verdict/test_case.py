"""A case: the step that it proposes, what an outcome makes of it, and that no part is convicted by exclusion."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from hil.verdict.case import MOST_STEPS, DiagnosisCase, Proposal, outcome_of
from hil.verdict.failures import Failures
from hil.verdict.parts import Part, Suspect
from hil.verdict.steps import StepOutcome, neighbour, steps, ways

RING = {Suspect(Part.SERVO, Channel.RING): 0.45, Suspect(Part.DIGIT, Channel.RING): 0.43, Suspect(Part.SETUP): 0.12}
ZEROS = {Suspect(Part.SETUP): 0.6, Suspect(Part.BOARD): 0.4}
LINK = {Suspect(Part.USB): 0.7, Suspect(Part.BOARD): 0.2, Suspect(Part.COMPUTER): 0.1}
OFF = {("staircase", "friction", "ring"): 3.0, ("staircase", "spring", "ring"): 2.0}
EVERY = [Suspect(part) for part in Part if part not in (Part.SERVO, Part.DIGIT)] + [
    Suspect(part, channel) for part in (Part.SERVO, Part.DIGIT) for channel in Channel
]


def on(label):
    return Failures({(experiment, metric, label): excess for (experiment, metric, _), excess in OFF.items()})


def well(before):
    """Return what a run finds that measures the same again, all within limits."""
    return Failures({}, frozenset(before.off))


def played(case, outcomes):
    """Play a case; `outcomes` gives the outcome of a step by its name, all others stay."""
    while (proposal := case.next_step) is not None:
        case = case.after(proposal, outcomes.get(proposal.step.name, StepOutcome.STAYS))
    return case


@pytest.mark.parametrize("name", steps())
def test_a_step_says_what_to_do_and_its_outcomes_are_likelihoods(name):
    step = steps()[name]
    assert step.text(Channel.RING, Channel.PINKY).endswith((".", "?"))
    assert set(step.convicts) <= set(step.outcomes)
    for suspect in EVERY:
        at = suspect.channel if step.of_one_channel else None
        for way in ways()[suspect.part]:
            likely = [step.likelihood(outcome, way, suspect.channel, at) for outcome in step.outcomes]
            assert sum(likely) == pytest.approx(1.0)
            assert min(likely) > 0.0


def test_every_way_of_a_part_is_ended_or_shown_by_some_step_and_the_ways_are_all_there_is():
    for of in ways().values():
        assert sum(of.values()) == pytest.approx(1.0)
        for way in of:
            assert any(step.likely.get(way) for step in steps().values()) or way.part is Part.DIGIT


def test_what_a_step_has_excluded_of_a_part_is_no_longer_expected_of_it():
    """A board was flashed for a hand that held something: what homing would mend was still thought to be a version."""
    case = DiagnosisCase(on("ring"), {Suspect(Part.SETUP): 0.5, Suspect(Part.BOARD): 0.5})
    homed = case.after(Proposal(steps()["home"]), StepOutcome.STAYS)
    flash = Proposal(steps()["flash"])
    assert homed.after(flash, StepOutcome.SEEN).likely[Suspect(Part.SETUP)] > 0.8
    assert homed.after(flash, StepOutcome.GONE).convicted == Suspect(Part.BOARD)


def test_what_needs_no_screwdriver_comes_first():
    assert not DiagnosisCase(on("ring"), RING).next_step.step.tool
    assert DiagnosisCase(on("ring"), LINK).next_step.step.name == "cable"


def test_a_servo_is_convicted_only_when_the_failure_went_along_with_it():
    case = played(DiagnosisCase(on("ring"), RING), {"exchange": StepOutcome.MOVED})
    assert case.convicted == Suspect(Part.SERVO, Channel.RING)


def test_a_digit_is_convicted_when_it_is_felt_to_be_other_or_another_servo_fails_there_too():
    felt = played(DiagnosisCase(on("ring"), RING), {"look": StepOutcome.SEEN})
    assert felt.convicted == Suspect(Part.DIGIT, Channel.RING)
    assert len(felt.done) == 1
    case = played(DiagnosisCase(on("ring"), RING), {})
    assert case.convicted == Suspect(Part.DIGIT, Channel.RING)
    assert [done.proposal.step.name for done in case.done] == ["look", "exchange"]


def test_that_an_exchanged_servo_changed_nothing_convicts_no_digit_where_the_board_may_be_it():
    case = DiagnosisCase(on("ring"), {**{s: 0.6 * w for s, w in RING.items()}, Suspect(Part.BOARD): 0.4})
    exchange = Proposal(steps()["exchange"], Channel.RING, Channel.PINKY)
    assert case.after(exchange, StepOutcome.STAYS).convicted is None


def test_a_failure_that_homing_mends_is_the_set_ups():
    case = played(DiagnosisCase(on("ring"), ZEROS), {"home": StepOutcome.GONE})
    assert case.convicted == Suspect(Part.SETUP)


def test_homing_that_mends_a_channel_that_was_limited_leaves_its_servo_suspected():
    """Homing writes the angle limits of a servo, too: they may be what was wrong."""
    limited = {Suspect(Part.SERVO, Channel.RING): 0.6, Suspect(Part.DIGIT, Channel.RING): 0.3, Suspect(Part.SETUP): 0.1}
    case = played(DiagnosisCase(on("ring"), limited), {"look": StepOutcome.GONE})
    assert case.convicted is None
    assert case.next_step is None
    assert set(case.remaining) == {Suspect(Part.SETUP), Suspect(Part.SERVO, Channel.RING)}
    assert played(DiagnosisCase(on("ring"), RING), {"look": StepOutcome.GONE}).convicted is None


def test_what_goes_with_something_that_was_taken_away_is_the_set_ups():
    assert played(DiagnosisCase(on("ring"), RING), {"look": StepOutcome.FREED}).convicted == Suspect(Part.SETUP)


def test_a_failure_that_another_computer_does_not_show_is_there_again_and_is_split():
    case = DiagnosisCase(on("ring"), {Suspect(Part.COMPUTER): 0.3, Suspect(Part.DRIVER): 0.4, Suspect(Part.USB): 0.3})
    case = case.after(Proposal(steps()["computer"]), StepOutcome.GONE)
    assert not case.gone
    assert case.convicted is None
    assert case.next_step.step.name == "release"
    assert played(case, {"release": StepOutcome.GONE}).convicted == Suspect(Part.DRIVER)
    assert played(case, {"release": StepOutcome.STAYS}).convicted == Suspect(Part.COMPUTER)


def test_a_little_that_stays_convicts_no_digit():
    little = DiagnosisCase(Failures({("staircase", "spring", "ring"): 3.0}), RING)
    assert played(little, {}).convicted is None


def test_a_little_that_failed_may_be_a_busy_computers_and_is_seen_again_first():
    little = DiagnosisCase(Failures({("staircase", "friction", "ring"): 1.4}), RING)
    assert little.next_step.step.name == "again"
    gone = played(little, {"again": StepOutcome.GONE})
    assert gone.gone
    assert gone.convicted is None
    assert len(gone.done) == 1


@pytest.mark.parametrize("key", [("session", "lost_replies", "hand"), ("run", "ended", "hand")])
def test_what_may_have_happened_once_is_seen_again_before_a_step_can_mend_it(key):
    """A cable was convicted, where the clock of the computer had been set once."""
    case = DiagnosisCase(Failures({key: 4.0}), LINK)
    assert case.next_step.step.name == "again"
    gone = played(case, {"again": StepOutcome.GONE})
    assert gone.convicted is None
    assert played(case, {"cable": StepOutcome.GONE}).convicted == Suspect(Part.USB)


@given(
    st.dictionaries(st.sampled_from(EVERY), st.floats(0.01, 1.0), min_size=1, max_size=6),
    st.lists(st.sampled_from(StepOutcome), min_size=MOST_STEPS, max_size=MOST_STEPS),
)
def test_a_case_ends_and_convicts_nobody_without_a_step_that_proves_it(weights, outcomes):
    total = sum(weights.values())
    case = DiagnosisCase(on("ring"), {suspect: weight / total for suspect, weight in weights.items()})
    assert case.convicted is None
    for wanted in outcomes:
        if (proposal := case.next_step) is None:
            break
        case = case.after(proposal, wanted if wanted in proposal.step.outcomes else StepOutcome.STAYS)
    assert len(case.done) <= MOST_STEPS
    if (convicted := case.convicted) is not None:
        proven = [s for one in case.done for s in one.proposal.step.convicted(one.outcome, one.proposal.at)]
        assert any(one.part is convicted.part and one.channel in (None, convicted.channel) for one in proven)


@pytest.mark.parametrize(
    ("after", "outcome"),
    [("ring", StepOutcome.STAYS), (None, StepOutcome.GONE)],
)
def test_a_failure_of_the_hand_stays_or_is_gone(after, outcome):
    found = well(on("ring")) if after is None else on(after)
    assert outcome_of(on("ring"), found, Proposal(steps()["home"])) is outcome


def test_a_failure_that_was_not_measured_again_is_not_known_to_be_gone():
    """A run that ended at its first gate was told as one in which all was well."""
    assert outcome_of(on("ring"), Failures(), Proposal(steps()["home"])) is None


@pytest.mark.parametrize(("excess", "outcome"), [(3.0, StepOutcome.GONE), (4.0, StepOutcome.STAYS)])
def test_a_little_elsewhere_is_not_the_failure(excess, outcome):
    """Servos that had become warm, and a thumb with another zero after homing, kept each failure from going."""
    before = Failures({("response", "telemetry_period", "hand"): 2.0})
    zero = {("excursion", "closed_percent", "thumb_flexor"): -excess, ("staircase", "excursion_hand", "ring"): -excess}
    warm = {("alike", "temperature", channel.label): -3.0 for channel in Channel}
    found = Failures({**zero, **warm}, frozenset(before.off))
    assert outcome_of(before, found, Proposal(steps()["cable"])) is outcome


def test_bytes_that_are_lost_again_are_not_gone_however_few_readings_they_spoil():
    """A link that flips bits was told to be well, where the second run fell on fewer of them."""
    lost = {("session", "lost_replies", "hand"): 3.0}
    before = Failures({**lost, **{("audit", "followed", finger.label): -9.0 for finger in FINGERS}})
    assert outcome_of(before, Failures(lost), Proposal(steps()["again"])) is StepOutcome.STAYS
    assert outcome_of(before, well(before), Proposal(steps()["again"])) is StepOutcome.GONE


@pytest.mark.parametrize(
    ("after", "outcome"), [("ring", StepOutcome.STAYS), ("pinky", StepOutcome.MOVED), (None, StepOutcome.GONE)]
)
def test_an_exchanged_servo_takes_its_failure_along(after, outcome):
    found = well(on("ring")) if after is None else on(after)
    exchanged = Proposal(steps()["exchange"], Channel.RING, Channel.PINKY)
    assert outcome_of(on("ring"), found, exchanged) is outcome


def test_a_servo_that_is_cold_beside_a_hot_one_has_left():
    hot = {("alike", "temperature", "ring"): 10.0, ("presence", "temperature", "ring"): 3.0}
    moved = {("alike", "temperature", "pinky"): 12.0, ("alike", "temperature", "ring"): -4.2}
    exchanged = Proposal(steps()["exchange"], Channel.RING, Channel.PINKY)
    assert outcome_of(Failures(hot), Failures(moved, frozenset(hot)), exchanged) is StepOutcome.MOVED


def test_a_failure_on_both_channels_has_not_gone_along():
    """A servo was convicted, where noise on the bus wanders over the channels."""
    both = Failures({**on("ring").off, **on("pinky").off, ("staircase", "spring_shape", "pinky"): 3.0})
    exchanged = Proposal(steps()["exchange"], Channel.RING, Channel.PINKY)
    assert outcome_of(on("ring"), both, exchanged) is StepOutcome.STAYS


def test_a_plug_is_not_convicted_of_what_a_board_may_have_forgotten_without_power():
    plugs = Proposal(steps()["supply"])
    for bus, convicted in ((0.3, None), (0.7, Suspect(Part.BUS))):
        case = DiagnosisCase(on("ring"), {Suspect(Part.BUS): bus, Suspect(Part.BOARD): 1.0 - bus})
        assert case.after(plugs, StepOutcome.GONE).convicted == convicted


def test_a_board_is_flashed_only_when_homing_alone_has_mended_no_servo():
    """A board would be convicted of an angle limit in a servo, which homing writes."""
    limited = {
        Suspect(Part.SERVO, Channel.RING): 0.55,
        Suspect(Part.BOARD): 0.3,
        Suspect(Part.DIGIT, Channel.RING): 0.15,
    }
    case = DiagnosisCase(on("ring"), limited)
    assert case.next_step.step.name in ("home", "look")
    assert {done.proposal.step.name for done in played(case, {}).done} & {"flash", "exchange"}


def test_a_servo_is_exchanged_with_one_that_does_not_fail():
    assert neighbour(Channel.RING, frozenset({Channel.PINKY})) is Channel.MIDDLE
    assert neighbour(Channel.THUMB_FLEXOR) not in (Channel.THUMB_ABDUCTION, Channel.THUMB_FLEXOR)
