"""Whole cases as an owner goes through them, in real time: `emulate` and `validate --hil`, then `diagnose --hil`.

`tox -e realtime` runs it.
"""

import pytest
from port_owner import diagnosed, first_run, served

from aero.actuation import ActuationMap
from aero.channels import WIRE_ORDER, Channel
from aero.exit_code import Exit
from aero.serial_transport import SerialTransport
from firmware_emulator.servo.models import REGISTERS

pytestmark = pytest.mark.slow
SHORT = ("--only", "presence", "--only", "audit", "--only", "excursion")
PALM = (*SHORT, "--only", "coupling")
"""Experiments that tell 0.2.0 from earlier versions, by the stop of the thumb at the palm."""
BUS_BAUD = 1_000_000
ANSWER, PATIENCE_S, TRIES = 6, 2.0, 5
"""Bytes of an answer of the bus, the time that it may take, s, and how often a packet is sent."""
NAMED = "0.2.0, for a right hand"


def case_of(tmp_path, *options, only=SHORT, prepare=lambda _bus: None):
    """Validate and diagnose a served hand; returns the exit code of the first run, that of the case, and its output."""
    link, bus = tmp_path / "hand", tmp_path / "bus"
    with served(link, "--bus-link", str(bus), "--seed", "7", *options) as hand:
        prepare(bus)
        late = "usb_timer=50" not in options
        found, said = first_run(tmp_path / "run", link, "--firmware", "0.2.0", *only, again_if_late=late)
        if found == Exit.WITHIN_LIMITS:
            return found, None, said
        code, said = diagnosed(tmp_path / "run", link, hand, named=NAMED)
    return found, code, " ".join(said.split())


def test_a_dead_motor_after_the_whole_run(tmp_path):
    """The guard stopped at the neighbour that had got the servo, and the digit was convicted."""
    found, code, said = case_of(tmp_path, "--fault", "motor_dead:ring", only=())
    assert (found, code) == (Exit.STOPPED, Exit.OUT_OF_LIMITS)
    assert "Servo of the ring finger, which is now at the" in said
    assert "Replace this servo." in said


def test_a_cable_off_its_spool(tmp_path):
    found, code, said = case_of(tmp_path, "--fault", "cable_snapped:middle")
    assert (found, code) == (Exit.OUT_OF_LIMITS, Exit.WITHIN_LIMITS)
    assert "Digit of the middle finger. It is mended." in said
    assert "ut the cable back on its path and spool" in said


def test_a_version_that_was_named_wrongly(tmp_path):
    found, code, said = case_of(tmp_path, "--fault", "board_runs_0.1.5", only=PALM)
    assert (found, code) == (Exit.OUT_OF_LIMITS, Exit.WITHIN_LIMITS)
    assert "Nothing is broken: name the version and side that are on the board, by --firmware" in said
    assert "--firmware 0.2.0" in said.rpartition("validate again")[2]


def test_a_usb_adapter_that_stalls(tmp_path):
    found, code, said = case_of(tmp_path, "--fault", "usb_timer=50")
    assert (found, code) == (Exit.OUT_OF_LIMITS, Exit.WITHIN_LIMITS)
    assert "Replace the USB cable, or connect the hand without the hub." in said


def leave_a_limit(bus):
    """Store an angle limit in the ring finger's servo, as another program does that uses the bus."""
    window = ActuationMap.for_firmware("0.2.0", side="right").window
    one, other = window.extend_counts[Channel.RING], window.grasp_counts[Channel.RING]
    stop = round(one + 0.5 * (other - one))
    low, high = (0, stop) if other > one else (stop, 4095)
    port = SerialTransport.open(str(bus), BUS_BAUD)
    for register, value in (("lock", 0), ("min_angle", low), ("max_angle", high), ("lock", 1)):
        row = REGISTERS[register]
        body = [WIRE_ORDER.index(Channel.RING), 3 + row.size, 3, row.address, *value.to_bytes(row.size, "little")]
        for _ in range(TRIES):  # its packet or the answer may collide with the board's
            port.discard_input()
            port.write(bytes((0xFF, 0xFF, *body, ~sum(body) & 0xFF)))
            if port.read(ANSWER, PATIENCE_S):
                break
    port.close()


def test_a_servo_limit_that_was_left_behind(tmp_path):
    found, code, said = case_of(tmp_path, prepare=leave_a_limit)
    assert (found, code) == (Exit.OUT_OF_LIMITS, Exit.WITHIN_LIMITS)
    assert "Nothing is broken. The step reset" in said


def test_nothing_wrong(tmp_path):
    found, code, _ = case_of(tmp_path)
    assert (found, code) == (Exit.WITHIN_LIMITS, None)
    assert not (tmp_path / "run" / "case.json").exists()
