"""A case: the step that it proposes, what an outcome clears and convicts, and how it ends."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from aero.safety import SafetyReason
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_words import conclusion
from hil.verdict.failures import RUN, Failures
from hil.verdict.group import AmbiguityGroup, CaseState, Proposal
from hil.verdict.outcome import experiments_that_failed, outcome_of
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.steps import OF_ONE, StepOutcome, candidates, modes, neighbour, steps

SERVO, DIGIT, SETUP = Suspect(Part.SERVO, Channel.RING), Suspect(Part.DIGIT, Channel.RING), Suspect(Part.SETUP)
RING = frozenset({SERVO, DIGIT, SETUP})
LINK = frozenset(map(Suspect, (Part.USB, Part.BOARD, Part.COMPUTER)))
OFF = {("staircase", "excursion_hand", "ring"): -3.0, ("staircase", "spring", "ring"): 2.0}
EVERY = [Suspect(part) for part in Part if part not in OF_ONE] + [
    Suspect(part, channel) for part in OF_ONE for channel in Channel
]
EXCHANGE = Proposal(steps()["exchange"], Channel.RING, Channel.PINKY)
STOP = ("run", "stray", "pinky")


def on(label):
    return Failures({(experiment, metric, label): excess for (experiment, metric, _), excess in OFF.items()})


def well(before):
    """Return what a run finds that measures the same again, all within limits."""
    return Failures({}, frozenset(before.off))


def case_of(suspects, weak=frozenset(), before=None):
    return DiagnosisCase((AmbiguityGroup(before or on("ring"), frozenset(suspects), frozenset(weak)),))


def answered(proposal, outcomes):
    usual = StepOutcome.NO if proposal.step.asks else StepOutcome.STAYS
    return outcomes.get(proposal.step.name, usual)


def played(case, outcomes):
    """Play a case; `outcomes` gives the outcome of a step by its name, all others stay or are answered with no."""
    while (proposal := case.next_step) is not None:
        case = case.after(proposal, answered(proposal, outcomes))
    return case


def names(case):
    return [done.proposal.step.name for done in case.done]


@pytest.mark.parametrize("name", steps())
def test_a_step_says_what_to_do_and_its_outcomes_are_possible(name):
    step = steps()[name]
    for channel in Channel:
        text = step.text(channel, neighbour(channel))
        assert text.endswith((".", "?"))
        assert not set("{}") & set(text)
    assert {*step.convicts, *step.clears} <= set(step.outcomes)
    assert step.asks == ("?" in step.do)


def test_every_mode_is_ruled_out_or_shown_by_a_step_and_has_an_action():
    for mode in modes().values():
        assert mode.action.endswith(".") is not mode.reset
        assert any(mode.name in named for step in steps().values() for named in step.convicts.values())


@pytest.mark.parametrize("suspect", EVERY, ids=str)
def test_every_suspect_has_a_mode(suspect):
    assert {mode.part for mode, _ in candidates([suspect])} == {suspect.part}


def test_the_channel_with_the_evidence_is_looked_at_before_one_that_leans_on_it():
    """The servo of a good abduction was exchanged first, where each failed reading was of CMC flexion."""
    two = [Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION]
    case = case_of([Suspect(Part.DIGIT, one) for one in two], before=on("thumb_cmc_flexion"))
    looked = [done.proposal.at for done in played(case, {}).done if done.proposal.step.name == "bend"]
    assert looked == [Channel.THUMB_CMC_FLEXION, Channel.THUMB_ABDUCTION]


def test_no_thumb_is_compared_with_a_finger():
    for channel in (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR):
        assert "finger" not in steps()["bend"].text(channel, neighbour(channel))


def test_the_cheapest_step_without_a_tool_comes_first():
    case = played(case_of(RING), {})
    assert names(case) == ["version", "home", "inspect", "bend", "exchange"]
    assert played(case_of(LINK), {}).done[0].proposal.step.name == "power"


def test_a_servo_is_convicted_when_the_failure_went_along_with_it():
    case = played(case_of(RING), {"exchange": StepOutcome.MOVED})
    assert (case.told, case.state) == ((SERVO,), CaseState.CONVICTED)


@pytest.mark.parametrize(("step", "action"), [("bend", "joint"), ("inspect", "cable"), ("none", "apart")])
def test_a_digit_is_convicted_when_it_is_felt_seen_or_another_servo_fails_there_too(step, action):
    case = played(case_of(RING), {step: StepOutcome.YES, "mend": StepOutcome.SKIPPED})
    assert case.told == (DIGIT,)
    assert action in conclusion(case)


def test_one_yes_convicts_no_mode_while_others_of_the_part_are_open():
    """A cable off its spool makes a digit loose: the joint was told to be freed, and the cable was never looked at."""
    for yes, other in (("inspect", "bend"), ("bend", "inspect")):
        case = case_of(RING).after(Proposal(steps()[yes], Channel.RING, Channel.PINKY), StepOutcome.YES)
        assert case.told == ()
        assert case.next_step.step.name == other
        both = played(case, {other: StepOutcome.YES, "mend": StepOutcome.GONE})
        assert names(both) == [yes, other, "mend"]
        assert (both.told, both.mended) == ((DIGIT,), True)
        assert {mode.name for mode in both.shown} == {"felt", "cable"}


def test_a_wrong_yes_is_found_out_by_the_mend():
    case = played(case_of(RING), {"inspect": StepOutcome.YES, "exchange": StepOutcome.MOVED})
    assert "mend" in names(case)
    assert case.told == (SERVO,)


@pytest.mark.parametrize("step", ["version", "voltage"])
def test_a_wrong_yes_about_the_whole_hand_is_found_out(step):
    case = case_of({SETUP, Suspect(Part.SUPPLY), Suspect(Part.BUS)})
    assert played(case, {step: StepOutcome.YES, "plugs": StepOutcome.GONE}).told == (Suspect(Part.BUS),)


def test_a_chance_event_leaves_the_case_and_hides_no_part():
    """One lost reply made a case of the link of a weak motor, and nobody remained."""
    lost = AmbiguityGroup(Failures({("session", "lost_replies", "hand"): 3.0}), LINK)
    weak = AmbiguityGroup(on("ring"), RING)
    case = DiagnosisCase((lost, weak))
    assert case.next_step.step.name == "again"
    assert {*case.remaining} == LINK | RING
    case = case.after(case.next_step, (StepOutcome.GONE, StepOutcome.STAYS))
    assert {*case.remaining} == RING
    alone = played(DiagnosisCase((weak,)), {"exchange": StepOutcome.MOVED})
    case = played(case, {"exchange": StepOutcome.MOVED})
    assert (names(case)[1:], case.told) == (names(alone), alone.told)


def test_two_faults_are_both_told():
    other = Suspect(Part.DIGIT, Channel.INDEX)
    groups = AmbiguityGroup(on("ring"), RING), AmbiguityGroup(on("index"), {other, Suspect(Part.SERVO, Channel.INDEX)})
    case = DiagnosisCase(groups)
    while (proposal := case.next_step) is not None:
        here = proposal.at is Channel.RING
        outcomes = {
            "exchange": (StepOutcome.MOVED, StepOutcome.STAYS) if here else StepOutcome.STAYS,
            "inspect": StepOutcome.NO if here else StepOutcome.YES,
            "mend": (StepOutcome.STAYS, StepOutcome.GONE),
        }
        case = case.after(proposal, answered(proposal, outcomes))
    assert {*case.told} == {SERVO, other}
    assert not case.mended


def test_a_mend_that_shows_late_is_credited_to_its_step():
    """Another supply was convicted, where flashing had mended the board, and only the next homing showed it."""
    board = case_of({Suspect(Part.BOARD), Suspect(Part.SUPPLY)})
    case = played(board, {"flash": StepOutcome.PARTLY, "again": StepOutcome.GONE})
    assert names(case)[-2:] == ["flash", "again"]
    assert case.told == (Suspect(Part.BOARD),)
    stayed = played(board, {"flash": StepOutcome.PARTLY, "supply": StepOutcome.GONE})
    assert stayed.told == (Suspect(Part.SUPPLY),)


def test_the_digits_of_the_thumb_are_one_until_something_splits_them():
    """The digit of CMC flexion was told, where the linkage of abduction was loose."""
    thumb = [Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR]
    strong = {Suspect(Part.DIGIT, one) for one in thumb} | {Suspect(Part.SERVO, thumb[1])}
    case = played(case_of(strong, before=on("thumb_cmc_flexion")), {})
    assert {*case.told} == {Suspect(Part.DIGIT, one) for one in thumb}
    assert conclusion(case).startswith("Digit of the thumb. ")


@pytest.mark.parametrize("outcome", [StepOutcome.UNSURE, StepOutcome.SKIPPED])
def test_an_exchange_that_does_not_show_that_it_was_done_convicts_nobody(outcome):
    """Servos that kept their IDs convicted a good digit, to be taken apart."""
    case = played(case_of(RING), {"exchange": outcome})
    assert (case.state, case.told) == (CaseState.OPEN, ())
    assert {*case.remaining} == {SERVO, DIGIT}


@pytest.mark.parametrize("answer", [StepOutcome.UNSURE, StepOutcome.SKIPPED])
def test_an_answer_that_is_not_sure_convicts_and_clears_nobody(answer):
    case = played(case_of(RING), {"bend": answer, "inspect": answer, "exchange": StepOutcome.SKIPPED})
    assert case.told == ()
    assert case.state is CaseState.OPEN
    assert set(case.remaining) == {SERVO, DIGIT}


def test_an_exchange_convicts_no_digit_while_the_board_may_be_it():
    case = case_of(RING | {Suspect(Part.BOARD)}).after(EXCHANGE, StepOutcome.STAYS)
    assert case.told == ()
    assert Suspect(Part.BOARD) in case.remaining


SHARED = frozenset(map(Suspect, (Part.BUS, Part.BOARD, Part.SUPPLY, Part.DRIVER)))


def test_a_digit_that_is_left_over_is_not_convicted_before_the_parts_that_all_digits_share():
    """A map of the owner's, a corroded pin and a plug were told as digits of good hands."""
    case = played(case_of(RING, SHARED), {})
    assert names(case)[:5] == ["version", "home", "inspect", "bend", "exchange"]
    assert {"plugs", "computer", "flash", "supply", "board"} <= set(names(case))
    assert case.told == (DIGIT,)
    for step, part in {"plugs": Part.BUS, "computer": Part.DRIVER, "supply": Part.SUPPLY, "board": Part.BOARD}.items():
        assert played(case_of(RING, SHARED), {step: StepOutcome.GONE}).told == (Suspect(part),)
    skipped = played(case_of(RING, SHARED), {"board": StepOutcome.SKIPPED})
    assert (skipped.told, set(skipped.remaining)) == ((), {DIGIT, Suspect(Part.BOARD)})


def test_parts_that_no_step_separates_are_joined_by_those_that_all_digits_share():
    """A corroded pin that two fingers share ended open, between servo and digit of one."""
    case = played(case_of(RING, SHARED), {"exchange": StepOutcome.PARTLY, "plugs": StepOutcome.GONE})
    assert case.told == (Suspect(Part.BUS),)


@pytest.mark.parametrize(
    "outcomes", [{"exchange": StepOutcome.MOVED}, {"bend": StepOutcome.YES, "mend": StepOutcome.GONE}], ids=str
)
def test_a_part_that_a_step_shows_directly_needs_no_further_step(outcomes):
    case = played(case_of(RING, SHARED), outcomes)
    assert names(case)[-1] == [*outcomes][-1]
    assert case.state is CaseState.CONVICTED


def test_a_repair_resets_nothing_that_an_earlier_homing_left():
    """A plug that was reseated ended as state that was reset, for the step homes the hand, too."""
    case = case_of(RING, SHARED).after(Proposal(steps()["power"]), StepOutcome.STAYS)
    case = case.after(Proposal(steps()["plugs"]), StepOutcome.GONE)
    assert (case.state, case.told) == (CaseState.CONVICTED, (Suspect(Part.BUS),))


def test_weak_suspects_take_over_when_steps_have_cleared_the_strong_ones():
    case = case_of({Suspect(Part.USB)}, {Suspect(Part.BUS)})
    assert case.remaining == (Suspect(Part.USB),)
    assert played(case, {"plugs": StepOutcome.GONE}).told == (Suspect(Part.BUS),)
    assert played(case, {}).state is CaseState.OPEN


def test_flashing_clears_no_board_and_another_board_does():
    """What a person really did is what is excluded: a flashed board was told to be another one."""
    board = case_of({Suspect(Part.BOARD)})
    flashed = board.after(Proposal(steps()["flash"]), StepOutcome.STAYS)
    assert flashed.remaining == (Suspect(Part.BOARD),)
    gone = played(board, {"flash": StepOutcome.GONE})
    assert gone.told == (Suspect(Part.BOARD),)
    assert "is replaced now" in conclusion(gone)
    assert "Replace the board." in conclusion(played(board, {"board": StepOutcome.GONE}))


@pytest.mark.parametrize(
    ("step", "outcome", "said"),
    [("home", StepOutcome.GONE, "angle limits"), ("power", StepOutcome.GONE, "the board's limits")],
)
def test_state_that_was_left_behind_is_named_and_nothing_is_broken(step, outcome, said):
    """An angle limit, a torque limit and a zero ended without a part once, although homing visibly mended them."""
    for suspects in (RING, {SETUP, Suspect(Part.BOARD)}, {SERVO, Suspect(Part.BOARD)}):
        case = case_of(suspects, {SETUP}).after(Proposal(steps()[step]), outcome)
        if Suspect(Part.BOARD) not in suspects and step == "power":
            continue
        assert case.state is CaseState.RESET
        assert conclusion(case).startswith("Nothing is broken.")
        assert said in conclusion(case)
        assert case.next_step is None


def test_what_was_taken_away_is_told():
    case = played(case_of(RING), {"home": StepOutcome.FREED})
    assert case.told == (SETUP,)
    assert "taken away" in conclusion(case)


def test_a_wrong_version_is_to_be_named_or_flashed():
    case = played(case_of({SETUP, Suspect(Part.BOARD)}), {"version": StepOutcome.YES, "flash": StepOutcome.GONE})
    assert names(case) == ["version", "flash"]
    assert case.told == (SETUP,)
    assert "--firmware" in conclusion(case)
    assert "hands.toml" in conclusion(case)


def test_a_failure_that_another_computer_does_not_show_is_there_again_and_is_split():
    case = case_of(map(Suspect, (Part.COMPUTER, Part.DRIVER, Part.USB)))
    case = case.after(Proposal(steps()["computer"]), StepOutcome.GONE)
    assert not case.gone
    assert case.told == ()
    assert case.next_step.step.name == "release"
    assert played(case, {"release": StepOutcome.GONE}).told == (Suspect(Part.DRIVER),)
    assert played(case, {"release": StepOutcome.STAYS}).told == (Suspect(Part.COMPUTER),)


@pytest.mark.parametrize(
    "off", [{("session", "lost_replies", "hand"): 3.0}, {("run", "ended", "hand"): 3.0}, {next(iter(OFF)): 1.4}]
)
def test_what_may_have_happened_once_is_seen_again_before_a_step_can_mend_it(off):
    """A cable was convicted, where the clock of the computer had been set once."""
    case = case_of(LINK, before=Failures(off))
    assert case.next_step.step.name == "again"
    gone = played(case, {"again": StepOutcome.GONE})
    assert (gone.state, gone.told, gone.mended) == (CaseState.NOT_SEEN_AGAIN, (), False)
    mended = played(case, {"cable": StepOutcome.GONE})
    assert (mended.told, mended.mended) == ((Suspect(Part.USB),), True)


def test_several_readings_of_one_kind_on_a_digit_are_no_chance():
    """A dead motor that the guard had stopped took five steps."""
    before = Failures({("audit", "pull", "ring"): -3.0, ("staircase", "spring", "ring"): -3.0})
    assert len(before.pieces) == 1
    assert case_of(LINK, before=before).next_step.step.name != "again"


@given(
    st.sets(st.sampled_from(EVERY), min_size=1, max_size=6),
    st.sets(st.sampled_from(EVERY), max_size=3),
    st.lists(st.sampled_from(StepOutcome), min_size=40, max_size=40),
)
def test_a_case_ends_and_convicts_nobody_without_a_step_that_shows_it(strong, weak, outcomes):
    case = case_of(strong, weak)
    assert case.told == ()
    for wanted in outcomes:
        if (proposal := case.next_step) is None:
            break
        possible = proposal.step.outcomes
        case = case.after(proposal, wanted if wanted in possible else possible[0])
        assert conclusion(case)
    assert case.state is not CaseState.GOES_ON
    changing = [(one.proposal.step.name, one.proposal.at) for one in case.done if one.proposal.step.name != "again"]
    assert len({*changing}) == len(changing)
    shown = {name for one in case.groups[0].settled for name in one.proposal.step.convicts.get(one.outcome, ())}
    for convicted in case.told:
        assert convicted in strong | weak
        assert convicted.part in {modes()[name].part for name in shown}


@given(st.sets(st.sampled_from(EVERY), min_size=1, max_size=6), st.randoms(use_true_random=False))
def test_the_order_of_suspects_decides_nothing(strong, random):
    shuffled = list(strong)
    random.shuffle(shuffled)
    assert case_of(shuffled).next_step == case_of(strong).next_step


@pytest.mark.parametrize(("after", "outcome"), [("ring", StepOutcome.STAYS), (None, StepOutcome.GONE)])
def test_a_failure_stays_or_is_gone(after, outcome):
    found = well(on("ring")) if after is None else on(after)
    assert outcome_of(on("ring"), found, Proposal(steps()["home"])) is outcome


def test_part_of_a_failure_is_neither():
    part = Failures({("staircase", "spring", "ring"): 2.0}, frozenset(OFF))
    assert outcome_of(on("ring"), part, Proposal(steps()["home"])) is StepOutcome.PARTLY
    other = Failures({("staircase", "tracking_rms", "ring"): 2.0}, frozenset(OFF))
    assert outcome_of(on("ring"), other, Proposal(steps()["home"])) is StepOutcome.PARTLY


def test_a_servo_that_the_runs_of_a_case_have_warmed_up_is_not_the_failure():
    """Reseated plugs had mended a finger, and its temperature after ten runs was part of the failure."""
    warm = Failures({("alike", "temperature", "ring"): 2.0}, frozenset(OFF))
    assert outcome_of(on("ring"), warm, Proposal(steps()["home"])) is StepOutcome.GONE


def test_a_failure_that_was_not_measured_again_is_not_known_to_be_gone():
    """A run that ended at its first gate was told as one in which all was well."""
    assert outcome_of(on("ring"), Failures(), Proposal(steps()["home"])) is None


def test_a_failed_reading_that_was_withheld_is_not_known_to_be_gone():
    """A busy computer withheld the palm's stop, and the thumb's other travel passed for it."""
    palm, abducted = (("coupling", name, "thumb_cmc_flexion") for name in ("stop_without_abduction", "stop_abducted"))
    before, power = Failures({palm: -2.0}), Proposal(steps()["power"])
    assert outcome_of(before, Failures(known=frozenset({abducted}), complete=True), power) is None
    assert outcome_of(before, Failures(known=frozenset({palm}), complete=True), power) is StepOutcome.GONE


@pytest.mark.parametrize(
    ("off", "outcome"),
    [
        ({("staircase", "spring", "ring"): 2.0}, None),
        ({("session", "stalls", "hand"): 2.0}, StepOutcome.STAYS),
        ({(RUN, SafetyReason.STALE.value, "hand"): 2.0}, StepOutcome.STAYS),
    ],
)
def test_a_power_cut_in_the_rerun_says_nothing_about_a_digit(off, outcome):
    """Three seconds without power after an exchange of servos convicted the digit that was left."""
    lost = Failures({(RUN, SafetyReason.SILENT.value, "hand"): 2.0, ("session", "lost_replies", "hand"): 2.0})
    assert outcome_of(Failures(off), lost, EXCHANGE) is outcome


def test_what_is_off_elsewhere_is_not_the_failure():
    """Servos that had become warm, and a thumb with another zero after homing, kept each failure from going."""
    before = Failures({("response", "telemetry_period", "hand"): 2.0})
    elsewhere = {("excursion", "closed_percent", "thumb_flexor"): -3.0, ("alike", "temperature", "ring"): -3.0}
    found = Failures(elsewhere, frozenset(before.off))
    assert outcome_of(before, found, Proposal(steps()["cable"])) is StepOutcome.GONE


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
    assert outcome_of(on("ring"), found, EXCHANGE) is outcome


@pytest.mark.parametrize("before", [OFF, {**OFF, **{("audit", f"{m}", "ring"): -9.0 for m in ("followed", "pull")}}])
def test_a_guard_stop_at_the_neighbour_is_evidence_there_however_much_failed_before(before):
    """Of a dead motor one stop weighed less than three failures before, and the good digit was convicted."""
    stopped = Failures({STOP: 3.0})
    assert outcome_of(Failures(before), stopped, EXCHANGE) is StepOutcome.MOVED
    again = Failures({("run", "stray", "ring"): 3.0})
    assert outcome_of(Failures(before), again, EXCHANGE) is StepOutcome.STAYS


@pytest.mark.parametrize(
    ("after", "outcome"),
    [
        (Failures({}, complete=True), StepOutcome.GONE),
        (Failures({("alike", "temperature", "pinky"): 1.5}, complete=True), StepOutcome.GONE),
        (Failures({("alike", "temperature", "ring"): 1.5}), StepOutcome.STAYS),
        (Failures({}), None),
    ],
)
def test_a_stop_is_gone_once_a_run_reaches_its_end(after, outcome):
    """A stop leaves no reading to measure again: flashing mended a hand, and each step after it was said to fail."""
    before = Failures({("run", SafetyReason.JUMP.value, "ring"): 3.0})
    assert outcome_of(before, after, Proposal(steps()["flash"])) is outcome


def test_a_gate_that_fails_at_the_neighbour_is_evidence_there():
    """A servo that ran away stopped the first gate in its new place, and the good digit was convicted."""
    gate, travel = {("presence", "idle_current", "pinky"): 3.0}, {("staircase", "excursion_hand", "ring"): -3.0}
    assert outcome_of(Failures(travel), Failures(gate), EXCHANGE) is StepOutcome.MOVED
    whole = Failures(gate, frozenset(travel), complete=True)
    assert outcome_of(Failures(travel), whole, EXCHANGE) is not StepOutcome.MOVED


def test_a_servo_that_is_cold_beside_a_hot_one_has_left():
    hot = {("alike", "temperature", "ring"): 10.0, ("presence", "temperature", "ring"): 3.0}
    moved = {("alike", "temperature", "pinky"): 12.0, ("alike", "temperature", "ring"): -4.2}
    assert outcome_of(Failures(hot), Failures(moved, frozenset(hot)), EXCHANGE) is StepOutcome.MOVED


def test_a_failure_on_both_channels_has_not_gone_along():
    """A servo was convicted, where noise on the bus wanders over the channels."""
    both = Failures({**on("ring").off, **on("pinky").off, ("staircase", "spring_shape", "pinky"): 3.0})
    assert outcome_of(on("ring"), both, EXCHANGE) is StepOutcome.STAYS


def test_a_plug_is_not_convicted_of_what_power_may_have_mended():
    case = case_of({Suspect(Part.BUS), Suspect(Part.BOARD)})
    assert case.after(Proposal(steps()["plugs"]), StepOutcome.GONE).told == ()
    assert played(case, {"plugs": StepOutcome.GONE}).told == (Suspect(Part.BUS),)


@pytest.mark.parametrize(
    ("off", "expected"),
    [
        ({("audit", "followed", "ring"): -9.0, ("staircase", "tracking_rms", "ring"): -9.0}, ("audit",)),
        ({("audit", "followed", "ring"): -9.0, ("staircase", "spring", "ring"): 9.0}, ("audit", "staircase")),
        ({("alike", "temperature", "ring"): 9.0}, ("presence", "audit", "staircase")),
        ({("session", "lost_replies", "hand"): 3.0}, ("presence", "audit", "staircase")),
    ],
)
def test_the_quickest_experiments_that_show_all_evidence_run_again(off, expected):
    assert experiments_that_failed(Failures(off), ("presence", "audit", "staircase")) == expected


def test_a_servo_is_exchanged_with_one_that_does_not_fail():
    assert neighbour(Channel.RING, frozenset({Channel.PINKY})) is Channel.MIDDLE
    assert neighbour(Channel.THUMB_FLEXOR) not in (Channel.THUMB_ABDUCTION, Channel.THUMB_FLEXOR)


@pytest.mark.parametrize("channel", FINGERS)
def test_where_an_exchanged_servo_is_now_is_said_of_the_index_too(channel):
    """Index is 0, and so the owner of a bad middle servo was told to replace the good one."""
    other = next(one for one in FINGERS if one is not channel)
    case = case_of({Suspect(Part.SERVO, other)}).after(replace(EXCHANGE, at=other, beside=channel), StepOutcome.MOVED)
    assert f"which is now at the {channel.label} finger" in conclusion(case)
