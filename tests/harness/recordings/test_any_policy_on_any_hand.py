"""Any policy on any hand through every byte: what must hold whichever hand, firmware, fault and policy are drawn."""

from typing import NamedTuple

import numpy as np
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st
from nightly import NIGHTLY
from policies import policy as random_policy
from policy_bytes import asked, fastest, frame, frames_again, positions_sent

from aero.channels import Channel, Joint
from aero.errors import AeroError
from aero.policy.running import RunSettings
from aero.policy.shipped import find_policy, shipped_policies
from aero.safety import SafetyReason, SafetyStopError, Thresholds
from firmware_emulator.firmware.profiles import PROFILES
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.policy_run import record_policy
from hil.recordings.recorder import Recorder
from hil.targets.hand_errors import FaultNeverFiredError
from model.units import shipped_units
from model.units.plausible import PLAUSIBLE
from simulator.routed import COMMAND_RANGE

PERIOD_S = 0.05
SHORT = RunSettings(seconds=0.6, approach_s=0.3, wait_s=0.1)
OPEN_DEG = 25.0
"""No joint of an open hand is bent further, as in tests/safety/test_never_left_closed.py."""
ROUND_TRIP = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0796e-3, 0.5719e-3])
"""How far a length may come back from where it went, m, abduction rad: the thumb's two fits disagree by so much over
its workspace (tests/aero/test_actuation_map.py); to this comes half a code."""
THUMB_CABLES = [Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR]
LINK_FAULTS = [
    f"{kind}={share}"
    for kind in (
        "reply_lost", "reply_byte_dropped", "reply_byte_doubled", "reply_byte_inserted", "reply_truncated",
        "reply_cut", "reply_doubled", "reply_junk", "reply_other_opcode", "command_lost",
    )
    for share in (0.05, 0.3)
]  # fmt: skip
LINK_FAULTS += ["reply_delayed=30", "reply_delayed=400", "command_delayed=30", "usb_timer=16", "link_slow=38400"]
LINK_FAULTS += ["link_silent=0.2@1"]
"""What the driver can see; what it cannot is in docs/internals/driver.md."""
BINDS = "binding"
"""The unit that a guard neither moves nor opens: its thumb holds against the palm."""
BOUND = {(reason, Channel.THUMB_ABDUCTION) for reason in (SafetyReason.CURRENT_AT_REST, SafetyReason.CURRENT)}
"""Why it is stopped: at rest, or in the slow opening of a board that has not homed."""


class Case(NamedTuple):
    """Everything that a run depends on."""

    side: str
    unit: str
    firmware: str
    seed: int
    fault: str | None
    policy: str | int
    """Name of a shipped one, or seed of a random one."""


class Outcome(NamedTuple):
    """What a run came to, as far as it came."""

    map: object
    recording: object
    run: object
    wire: tuple
    bent_deg: float
    """Largest angle of any free joint when the program had left the hand."""


units = st.sampled_from(shipped_units()) | st.integers(0, 10_000).map(lambda seed: f"{PLAUSIBLE}{seed}")
cases = st.builds(
    Case,
    st.sampled_from(["right", "left"]),
    units,
    st.sampled_from(sorted(PROFILES)),
    st.integers(0, 2**31 - 1),
    st.none() | st.sampled_from(LINK_FAULTS),
    st.sampled_from(shipped_policies()) | st.integers(0, 10_000),
)


def policy_of(case):
    return find_policy(case.policy) if isinstance(case.policy, str) else random_policy(case.policy)


def played(case):
    """Run a case on a guarded hand and leave it; what a fault makes the driver raise is its right."""
    faults = [parse_fault(case.fault)] if case.fault else []
    result = recording = target = None
    opening = open_target(
        unit=case.unit, side=case.side, firmware=case.firmware, seed=case.seed, guarded=True, faults=faults,
        thresholds=Thresholds(),
    )  # fmt: skip
    recorder = None
    try:
        with opening as target:
            recorder = Recorder(target, "policy")
            result = record_policy(target, recorder, policy_of(case), SHORT)
            recording = recorder.finish()
    except FaultNeverFiredError:
        pass
    except (AeroError, SafetyStopError, ConnectionError) as error:
        bound = case.unit == BINDS and isinstance(error, SafetyStopError) and (error.reason, error.channel) in BOUND
        if not (case.fault or bound):
            raise
    electronics = target.truth.electronics
    electronics.clock.sleep_until(electronics.clock.now() + 0.5)
    electronics.advance_plant()
    bent = np.abs(np.rad2deg(target.truth.plant.joint_angles()))
    if case.unit == BINDS:
        bent[Joint.THUMB_ABDUCTION] = 0.0
    return Outcome(target.map, recording, result, target.wire.since(0, 0.0), float(bent.max()))


@settings(
    max_examples=400 if NIGHTLY else 3,
    deadline=None,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink],
)
@given(cases)
@example(Case("left", "reference", "0.2.0", 0, None, "steady"))
@example(Case("right", "paper", "pre", 1, "reply_lost=0.3", 7))
@example(Case("right", BINDS, "pre", 0, None, "steady"))
def test_any_policy_on_any_hand(case):
    policy, outcome = policy_of(case), played(case)
    assert played(case).wire == outcome.wire, "the same case gives the same bytes"
    assert outcome.bent_deg < OPEN_DEG, "never left closed"
    assert outcome.recording is None or case.unit != BINDS, "a thumb that binds is not moved"
    if outcome.recording is None:
        return
    recording, codec, run = outcome.recording, outcome.map, outcome.run.run
    if not case.fault:
        assert (run.ending.name, run.steps, run.missing) == ("TIME", 12, 0), run.reason
    if not run.steps:
        return

    for name, series in recording.series.items():
        assert np.isfinite(series.values).all(), name
    assert np.isfinite([run.latest_s, run.peak_current_a]).all()

    goals, actions = recording["goal"].values, recording["action"].values
    low, high = np.array([COMMAND_RANGE[channel] for channel in sorted(COMMAND_RANGE)]).T
    assert (np.abs(actions) < 1.0).all()
    assert ((low <= goals) & (goals <= high)).all()

    again = frames_again(policy, codec, recording["codes"].values, SHORT.correction)
    assert again == [frame(row) for row in recording["command_codes"].values], "every byte follows from what was read"
    sent, _ = positions_sent(recording.wire)
    grasp = np.round(asked(codec, np.add(policy.settings.nominal, SHORT.correction)))
    begins = int(np.flatnonzero((sent == grasp).all(axis=1))[0])
    acted = sent[begins : begins + 1 + run.steps]
    np.testing.assert_array_equal(acted[1:], recording["command_codes"].values)
    assert (np.abs(np.diff(acted, axis=0)) <= fastest(codec, PERIOD_S) + 1.0).all()
    turns = recording["command_codes"].times
    assert (turns - turns[0] >= PERIOD_S * np.arange(len(turns)) - 0.02).all(), "never ahead of its rate"

    half = 0.5001 * np.abs(codec.lengths_from_codes(np.full(7, 1)) - codec.lengths_from_codes(np.zeros(7, int)))
    angles = codec.angles_from_travel(codec.travel_from_lengths(goals + SHORT.correction))
    codes, saturated = codec.saturating_codes(angles)
    # The thumb's cables pay for a thumb that is not abducted as far as it was told: 2.5 mm/rad.
    held_back = saturated | (saturated[:, [Channel.THUMB_ABDUCTION]] & np.isin(Channel, THUMB_CABLES))
    back = np.abs(codec.lengths_from_codes(codes) - SHORT.correction - goals)
    assert (held_back | (back <= ROUND_TRIP + 2 * half)).all()
