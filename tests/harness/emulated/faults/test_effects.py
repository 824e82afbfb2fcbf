"""Every fault at its severe severity does what its row says, against a healthy hand of the same seed.

An effect is looked for where it is felt: in the true joints, in what the driver reads, in the time that a session takes
or in calls that fail; never in a field that was set.
"""

import functools
from dataclasses import replace

import numpy as np
import pytest
from drawn import drawn

from aero import Channel
from aero.channels import FINGERS
from aero.errors import AeroError
from aero.firmware import FIRMWARE
from hil.emulated.any_hand import open_target
from hil.emulated.faults import CATALOGUE
from hil.emulated.faults.mechanics import JOINTS
from hil.verdict.part import Part
from model.units import load_unit
from train.identification.unit_file import unit_toml

STEPS, STEP_S = 10, 0.15
LEVELS = np.array([60000, 48000, 36000, 30000, 40000, 24000, 50000])
"""Of the closed hand: each channel its own, so that two that are exchanged differ."""
FAILURES = 3
"""Calls that fail before a session is given up."""
BEGINS_S = 0.4

LEAST = {
    "joints": {  # rad
        **dict.fromkeys(("gear_friction", "gear_jammed", "slow_servo", "late_goals", "supply_low", "supply_sags"), 0.3),
        **dict.fromkeys(
            ("cable_long", "cable_short", "cable_snapped", "spring_off", "digit_jammed", "winding_reversed"), 0.5
        ),
        **dict.fromkeys(("cable_friction", "stiff_joint", "spool_wrong", "thumb_derailed", "stop_early"), 0.2),
        **dict.fromkeys(("motor_dead", "motor_weak", "motor_intermittent", "motor_runaway", "spring_strong"), 0.5),
        **dict.fromkeys(("finger_cables_swapped", "thumb_cables_swapped", "finger_ids_exchanged"), 0.2),
        **dict.fromkeys(("thumb_ids_exchanged", "encoder_frozen", "servo_missing", "protection_low"), 0.5),
        **dict.fromkeys(("encoder_scale", "encoder_offset", "encoder_slip", "cable_soft", "servo_id_doubled"), 0.1),
        **dict.fromkeys((name for name in CATALOGUE if name.startswith("board_runs_")), 0.1),
        **dict.fromkeys(("board_of_other_side", "board_restart", "nvs_lost", "trim_left_in"), 0.1),
        **dict.fromkeys(("calibrated_mid", "calibrated_mid_and_homed", "supply_browns_out"), 0.2),
        **dict.fromkeys(("power_cycle", "board_hangs", "link_hangs_up", "command_lost"), 0.3),
        "encoder_play": 0.02,
        "encoder_creep": 0.01,
        "stop_gone": 0.3,
        "command_delayed": 0.3,
        "command_doubled": 0.1,
        "command_bit_flipped": 0.1,
    },
    "codes": dict.fromkeys(
        ("slow_turnaround", "servo_silent", "answers_damaged", "position_garbage", "reply_stale", "reply_bit_flipped"),
        1000,
    )
    | {"position_coarse": 200, "encoder_quantised": 500},
    "currents": {"encoder_noise": 1.0, "current_wrong": 1.0},  # A
    "temperatures": dict.fromkeys(("temperature_wrong", "servo_hot"), 35),  # °C
    "failures": dict.fromkeys(
        (
            *(
                "command_truncated",
                "command_byte_dropped",
                "command_byte_doubled",
                "command_byte_inserted",
                "link_silent",
            ),
        ),
        1,
    ),
    "seconds": dict.fromkeys(  # that the session takes longer
        (
            *("reply_truncated", "reply_lost", "reply_byte_dropped", "reply_byte_doubled", "reply_byte_inserted"),
            *("reply_doubled", "reply_delayed", "usb_timer", "reply_cut", "reply_reordered", "reply_other_opcode"),
            *("link_slow", "host_stalls"),
        ),
        0.2,
    ),
    "bytes": {"reply_junk": 1, "boot_text": 1},
}
"""What is felt most of each, and how much of it at least."""


def session(*faults, firmware=None, unit="reference"):
    """Close and open a hand twice; return what was felt, by name."""
    felt = {"joints": [], "codes": [], "currents": [], "temperatures": []}
    failures = 0
    with open_target(faults=faults, seed=3, firmware=firmware, unit=unit) as target:
        hand, plant, clock = target.hand, target.truth.plant, target.clock
        calls = {"codes": hand.read_codes, "currents": hand.read_currents, "temperatures": hand.read_temperatures}
        for step in range(STEPS):
            if failures < FAILURES:
                failures += attempt(lambda level=step // 3 % 2: hand.command_codes(level * LEVELS)) is None
            clock.sleep_until(clock.now() + STEP_S)
            felt["joints"].append(plant.joint_angles())
            for name, call in calls.items():
                read = attempt(call) if failures < FAILURES else np.full(7, np.nan)
                failures += read is None
                felt[name].append(np.full(7, np.nan) if read is None else read)
        read_bytes = sum(len(record.data) for record in target.wire.since(0, 0.0) if record.direction == "from_hand")
        return {name: np.array(values, float) for name, values in felt.items()} | {
            "failures": failures,
            "seconds": clock.now(),
            "bytes": read_bytes,
        }


def attempt(call):
    try:
        result = call()
    except (AeroError, ConnectionError):
        return None
    return () if result is None else result


@functools.cache
def healthy(firmware, unit="reference"):
    return session(firmware=firmware, unit=unit)


@pytest.fixture(scope="module")
def firm_supply(tmp_path_factory):
    """The reference unit on a supply that does not sag, through which all motors feel what one draws."""
    unit = load_unit("reference")
    path = tmp_path_factory.mktemp("unit") / "firm.toml"
    firm = replace(unit, hand=replace(unit.hand, supply_sag=0.0))
    path.write_text(unit_toml(firm, "", {}), encoding="utf-8")
    return str(path)


def declared(name):
    """Return a version that moves otherwise than the one that a fault puts on the board."""
    runs = FIRMWARE.get(name.removeprefix("board_runs_"))
    return "0.1.5" if runs is not None and runs.moves_as == "0.2.0" else "0.2.0"


def severe(fault):
    return fault.at(fault.steps()[-1], at_s=min(fault.at_s, BEGINS_S))


def test_every_fault_is_judged():
    judged = [name for names in LEAST.values() for name in names]
    assert sorted(judged) == sorted(CATALOGUE)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of a reading that never came
@pytest.mark.parametrize(
    ("quantity", "name"), drawn([(quantity, name) for quantity, names in LEAST.items() for name in names], 30)
)
def test_a_severe_fault_is_felt(quantity, name):
    good, bad = healthy(declared(name)), session(severe(CATALOGUE[name]), firmware=declared(name))
    assert np.nanmax(np.abs(bad[quantity] - good[quantity])) >= LEAST[quantity][name]


ONE_FINGER = [
    name
    for name, fault in CATALOGUE.items()
    if fault.channels == tuple(Channel)
    and fault.later
    and fault.part in (Part.DIGIT, Part.SERVO)
    and fault.excludes != "id"
]


@pytest.mark.parametrize("name", drawn(ONE_FINGER, 6))
def test_a_fault_of_a_finger_leaves_the_other_fingers_alone(name, firm_supply):
    """And one that is not the default finger."""
    bad = session(CATALOGUE[name].at(CATALOGUE[name].steps()[-1], Channel.RING, BEGINS_S), unit=firm_supply)
    good = healthy("0.2.0", firm_supply)
    for finger in set(FINGERS) - {Channel.RING}:
        moved = np.abs(bad["joints"] - good["joints"])[:, list(JOINTS[finger])]
        assert np.max(moved) < 0.02, finger


@pytest.mark.slow
def test_a_snapped_cable_stays_slack_however_often_the_hand_homes():
    """Homing wound 0.9 m of slack up in five searches, and the digit was healthy."""
    with open_target(seed=3, faults=[CATALOGUE["cable_snapped"].at(channel=Channel.RING)]) as target:
        for _ in range(5):
            target.hand.home()
        target.hand.command_codes([30000] * len(Channel))
        target.clock.sleep_until(target.clock.now() + 2.0)
        angles = target.truth.plant.joint_angles()
        assert np.max(np.abs(angles[list(JOINTS[Channel.RING])])) < 0.02
