"""What each version says to its servos while it homes a right hand, packet by packet."""

from itertools import groupby

import pytest

from tests.firmware_emulator.conftest import AT_STOPS, frame, stopped_bench

SLOW = ("pre", "0.1.0", "0.1.1", "0.1.2")
FAST = ("0.1.3", "0.1.4", "0.1.5", "0.2.0")
NAMES = {5: "id", 9: "min", 11: "max", 28: "limit", 33: "mode", 40: "torque", 55: "lock"}


def signed(word):
    return word if word < 0x8000 else 0x8000 - word


def spoken(packet):
    """An instruction packet in words."""
    servo, code, parameters = packet[2], packet[4], packet[5:-1]
    match code:
        case 0x01:
            return f"{servo} ping"
        case 0x02:
            return f"{servo} read {parameters[0]}+{parameters[1]}"
        case 0x0B:
            return f"{servo} calibrate"
        case 0x03 if parameters[0] == 41:
            position, torque, speed = (int.from_bytes(parameters[at : at + 2], "little") for at in (2, 4, 6))
            return f"{servo} goal {signed(position)} {speed}/{parameters[1]} {torque}"
        case 0x03:
            return f"{servo} {NAMES[parameters[0]]} {int.from_bytes(parameters[1:], 'little')}"
    return None


def script(log):
    """The spoken packets of a homing, without telemetry and with each search said once."""
    lines = [line for line in (spoken(packet) for _, packet in log if packet[2] != 0xFE) if line]
    search = ("15536", "read 69+2", "read 56+2")
    folded = []
    for is_search, run in groupby(lines, lambda line: any(part in line for part in search)):
        said = list(run)
        folded += sorted({line for line in said if "15536" in line}) if is_search else said
    return folded


def calibration(servo):
    return [f"{servo} torque 0", f"{servo} torque 0", f"{servo} lock 0", f"{servo} calibrate"]


def limits(servo, low, high):
    said = ("torque 0", "lock 0", f"min {low}", f"max {high}", "lock 1", "torque 1")
    return [f"{servo} {what}" for what in said]


def begin(servo, *, opened):
    return [*(limits(servo, 0, 0) if opened else []), f"{servo} mode 0", f"{servo} read 56+15"]


def slow_script(version):
    """Homing of a right hand up to 0.1.2, with `*` for positions that depend on the contact."""
    opened = version in {"0.1.1", "0.1.2"}
    first = 650 if version == "pre" else 750
    windows = [(797, 2161), (1935, 3344), (1002, 4095), *[(0, 3391)] * 4]
    ends = ["910 60/50 500", "3231 60/50 500", f"{1740 if opened else 1115} 60/50 500", *["3278 60/50 500"] * 4]
    goals = [15536, -15536, 15536, *[-15536] * 4]
    lines = []
    for servo in range(7):
        lines += begin(servo, opened=opened)
        lines += [f"{servo} goal {goals[servo]} 10/10 {950 if servo else first}"]
        lines += [f"{servo} goal * 60/50 1000", *calibration(servo)]
        if servo >= 2:
            lines += [f"{servo} goal * 60/50 500", *calibration(servo)]
        lines += [f"{servo} goal {ends[servo]}"]
        lines += limits(servo, *windows[servo]) if opened else []
    if version == "pre":
        return [*lines, "0 goal 2048 60/50 500", "2 goal 1115 60/50 500"]
    return lines + [f"{servo} goal {(2048, 3231, 1115, *[3278] * 4)[servo]} 2400/0 1023" for servo in range(7)]


def fast_script(version):
    """Homing of a right hand at boot from 0.1.3 on, and the pings behind it: of the boot text or of the repair."""
    shifted = version == "0.2.0"
    goals = [15536, -15536, 15536, *[-15536] * 4]
    ends = [797 if shifted else 910, 3344 if shifted else 3231, 1740, *[3278] * 4]
    lines = []
    for servo in (0, 1, 2):
        lines += [*begin(servo, opened=True), f"{servo} goal {goals[servo]} 2400/0 950"]
        lines += [f"{servo} goal * 2400/0 1000", *calibration(servo)]
        lines += [f"{servo} goal * 2400/0 1000", *calibration(servo)] if servo == 2 else []
        lines += [f"{servo} goal {ends[servo]} 2400/0 1000"]
    for servo in range(3, 7):
        lines += begin(servo, opened=True)
    lines += ["fingers search"]
    for servo in range(3, 7):
        lines += [f"{servo} goal * 2400/0 1000", *calibration(servo)]
        lines += [f"{servo} goal * 2400/0 1000", *calibration(servo)]
        lines += [f"{servo} goal {ends[servo]} 2400/0 1000"]
    extends = (1935 if shifted else 2048, 3344 if shifted else 3231, 1115, *[3278] * 4)
    lines += [f"{servo} goal {extends[servo]} 2400/0 1023" for servo in range(7)]
    after = ("ping", "read 28+2") if version in {"0.1.5", "0.2.0"} else ("ping",)
    return lines + [f"{servo} {what}" for servo in range(7) for what in after]


def masked(lines, expected):
    """Lines with the positions that `expected` leaves open masked out."""
    out = []
    for line, wanted in zip(lines, expected, strict=True):
        words = line.split()
        out.append(" ".join([*words[:2], "*", *words[3:]]) if "goal *" in wanted else line)
    return out


def fold_fingers(lines):
    """Replace the common search of the fingers, whose order depends on who arrives first, by one line."""
    parallel = [line for line in lines if line.split()[0] in "3456" and ("15536" in line or "60/50 1000" in line)]
    first = lines.index(parallel[0])
    assert {line for line in parallel if "15536" in line} == {
        f"{servo} goal -15536 2400/0 950" for servo in range(3, 7)
    }
    assert sorted(line[0] for line in parallel if "60/50" in line) == list("3456")
    return (
        [line for line in lines[:first] if line not in parallel]
        + ["fingers search"]
        + [line for line in lines[first:] if line not in parallel]
    )


@pytest.mark.parametrize("version", SLOW)
def test_slow_homing_says_what_the_version_says(make_host, bus_log, version):
    # Every shaft stands at its stop, so that nothing has to be searched for long.
    host = make_host(plant=stopped_bench(AT_STOPS), firmware=version, start="reset")
    host.wait(0.5)
    host.link.discard_input()
    bus_log.clear()
    assert host.ask(0x01, timeout=60.0) == frame("01")
    lines, expected = script(bus_log), slow_script(version)
    assert masked(lines, expected) == expected


@pytest.mark.parametrize("version", FAST)
def test_fast_homing_says_what_the_version_says(make_host, bus_log, version):
    # At boot, where no telemetry task races the packets at the end.
    host = make_host(plant=stopped_bench(), firmware=version, start="power_on")
    host.wait(6.0)
    lines, expected = fold_fingers(script(bus_log)), fast_script(version)
    assert masked(lines, expected) == expected
