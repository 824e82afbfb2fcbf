"""Diagnostic rules for single servos and whole buses, one function per rule, and a repeatability test."""

from collections.abc import Callable, Iterator, Sequence

from feetech_robots.feetech_bus import FeetechBus
from feetech_robots.survey import FEEDBACK, READS, TORQUE, Surveyed
from hil.cli.doctor.finding import Examined, Subject, Verdict

Found = tuple[Verdict, str, str]
"""Verdict, observation, remedy."""

WARM_C = 10
"""Margin below the temperature limit that yields a warning, °C."""
SAG_V = 0.5
"""Threshold of the voltage difference between servos, V; above it the wiring is suspect (assumption)."""
NEAR_V = 0.3
STATUS = {
    0x01: ("voltage", "measure the supply at the servo's plug; a long or thin cable sags"),
    0x02: ("encoder", "power it off and on; if the bit stays, the encoder is broken: replace the servo"),
    0x04: ("temperature", "let it cool; look for what it holds or pushes against"),
    0x08: ("current", "look for a blocked joint, then switch its torque off and on"),
    0x20: ("overload", "look for a blocked joint, then give it another goal"),
}
"""Meaning and remedy of each status bit. Source: transcribed memory tables."""
GOAL = 42
TIMES = 4
WAIT_S = 0.6
"""Wait for a move of at most 200 counts, s."""
LARGEST_COUNTS = 200
SPREAD_COUNTS = 6
"""Threshold of the spread of reached positions, counts; above it a warning. Gear play is unseen by the encoder."""
STATIC_COUNTS = 40
"""Threshold of the static error under load, counts; above it a warning (assumption)."""


def _line(one: Surveyed) -> Iterator[Found]:
    if one.damaged * 2 >= READS and not one.pings_damaged:
        yield (
            Verdict.WRONG,
            f"{one.damaged} of {READS} long answers are damaged and no ping is: two servos have this ID",
            "leave one of them on the bus, and give it another ID: aero-hil servos --port PORT set-id",
        )
    elif one.damaged:
        yield (
            Verdict.WRONG if one.damaged * 2 >= READS else Verdict.LOOK,
            f"{one.damaged} of {READS} answers are damaged",
            "look at ground and data wires, and for a second program or board on the bus",
        )
    if one.silent:
        yield (
            Verdict.WRONG if one.silent * 2 >= READS else Verdict.LOOK,
            f"{one.silent} of {READS} reads are not answered",
            "push its plugs in; with an FTDI adapter set the latency timer to 1 ms",
        )


def _status(one: Surveyed) -> Iterator[Found]:
    for bit, (name, remedy) in STATUS.items():
        if one.status & bit:
            yield Verdict.WRONG, f"it reports {name} (status 0x{one.status:02X})", remedy


def _supply(one: Surveyed) -> Iterator[Found]:
    low, high = one.voltage_limits_v
    if not low <= one.voltage_v <= high:
        yield (
            Verdict.WRONG,
            f"{one.voltage_v:g} V is not within its limits of {low:g} to {high:g} V",
            "use the supply that the servo is made for: 7.4 V and 12 V servos look alike",
        )
    elif one.voltage_v - low < NEAR_V:
        yield Verdict.LOOK, f"{one.voltage_v:g} V is close to its lower limit of {low:g} V", "measure under load"


def _heat(one: Surveyed) -> Iterator[Found]:
    if one.temperature_c > one.max_temperature_c:
        verdict = Verdict.WRONG
    elif one.temperature_c > one.max_temperature_c - WARM_C:
        verdict = Verdict.LOOK
    else:
        return
    yield verdict, f"{one.temperature_c} °C; its torque switches off above {one.max_temperature_c} °C", STATUS[0x04][1]


def _limits(one: Surveyed) -> Iterator[Found]:
    low, high = one.limits_counts
    if (low, high) == (0, 0):
        return
    if low >= high:
        yield Verdict.WRONG, f"its angle limits are {low} and {high}", "set the lower one below the upper one"
    elif not low <= one.position_counts <= high:
        yield (
            Verdict.LOOK,
            f"it stands at {one.position_counts}, outside its angle limits of {low} to {high}",
            "the first goal moves it; calibrate again if horn or offset was changed",
        )


def _offset(one: Surveyed) -> Iterator[Found]:
    bit = one.kind.offset_sign_bit
    if bit is None:
        return
    if one.offset_word >> (bit + 1):
        yield (
            Verdict.WRONG,
            f"its offset register holds 0x{one.offset_word:04X}, which is not a number with its sign in bit {bit}",
            "a driver wrote a two's complement; write the offset again as magnitude and sign",
        )
    elif abs(one.offset_counts) == (1 << bit) - 1:
        yield (
            Verdict.LOOK,
            f"its offset of {one.offset_counts} is the largest that the register holds",
            "it may have been cut off: put the horn on again near the middle, then calibrate",
        )


def _settings(one: Surveyed) -> Iterator[Found]:
    if one.mode:
        yield Verdict.LOOK, f"its mode is {one.mode}, not position", "write 0 to register 33 if goals are positions"
    if one.counts_turns and not one.kind.turns:
        yield (
            Verdict.LOOK,
            "its readings count turns, from one turn below zero to beyond 4095",
            "clear bit 4 (16) of register 18 if a reading is one turn: calibration and drivers expect 0 to 4095",
        )
    if not one.response_level:
        yield Verdict.LOOK, "it acknowledges no writes (register 8 is 0)", "write 1 to register 8: drivers wait for it"
    if one.unlocked:
        yield Verdict.LOOK, "its EEPROM is unlocked", f"write 1 to register {one.kind.lock}: each write wears it"


EACH: dict[str, Callable[[Surveyed], Iterator[Found]]] = {
    "line": _line,
    "status": _status,
    "supply": _supply,
    "temperature": _heat,
    "limits": _limits,
    "offset": _offset,
    "settings": _settings,
}
"""Rules for one servo, by name of the finding."""


def _models(all_of_them: Sequence[Surveyed]) -> Iterator[Found]:
    for model in sorted({one.model for one in all_of_them if one.model is not None}):
        same = [one for one in all_of_them if one.model == model]
        versions = sorted({one.firmware for one in same})
        if len(versions) > 1:
            said = ", ".join(
                f"{major}.{minor} (ID {' '.join(str(one.id) for one in same if one.firmware == (major, minor))})"
                for major, minor in versions
            )
            yield (
                Verdict.LOOK,
                f"{same[0].kind.name} servos have different firmware: {said}",
                "bring them to one version with the maker's program; LeRobot refuses such a bus",
            )


def _voltages(all_of_them: Sequence[Surveyed]) -> Iterator[Found]:
    read = [one for one in all_of_them if one.model is not None]
    if len(read) < 2:
        return
    low, high = min(read, key=lambda one: one.voltage_v), max(read, key=lambda one: one.voltage_v)
    if high.voltage_v - low.voltage_v > SAG_V:
        yield (
            Verdict.LOOK,
            f"ID {low.id} measures {low.voltage_v:g} V and ID {high.id} {high.voltage_v:g} V",
            "look at the plug and the wire between them",
        )


def _rates(all_of_them: Sequence[Surveyed]) -> Iterator[Found]:
    rates = sorted({one.baud for one in all_of_them})
    if len(rates) > 1:
        said = ", ".join(
            f"{' '.join(str(one.id) for one in all_of_them if one.baud == rate)} at {rate}" for rate in rates
        )
        yield Verdict.WRONG, f"servos listen at different baud rates: ID {said}", "write one rate to register 6 of all"


TOGETHER: dict[str, Callable[[Sequence[Surveyed]], Iterator[Found]]] = {
    "firmware": _models,
    "voltages": _voltages,
    "baud": _rates,
}
"""Rules for all servos of a bus, by name of the finding."""


def judge(found: Sequence[Surveyed], expected: Sequence[int] = ()) -> Iterator[Examined]:
    """Yield errors and warnings about a bus, and one OK line for each servo without any.

    Args:
        found: surveyed servos.
        expected: IDs that must answer; empty for no check.
    """
    for name, rule in TOGETHER.items():
        for verdict, said, remedy in rule(found):
            yield Examined(name, verdict, said, remedy, subject=Subject.HAND)
    ids = [one.id for one in found]
    for missing in [servo for servo in expected if servo not in ids]:
        yield Examined(
            f"servo {missing}", Verdict.WRONG, "it does not answer", "look at its plugs, its ID and its baud rate",
            subject=Subject.HAND,
        )  # fmt: skip
    for one in found:
        if expected and one.id not in expected:
            yield Examined(
                f"servo {one.id}", Verdict.WRONG, "it answers, and was not expected",
                "unplug it, give it another ID, or name it in --expect", subject=Subject.HAND,
            )  # fmt: skip
        wrong = [
            Examined(f"servo {one.id} {name}", verdict, said, remedy, subject=Subject.HAND)
            for name, rule in EACH.items()
            if one.model is not None or name == "line"
            for verdict, said, remedy in rule(one)
        ]
        yield from wrong or [Examined(f"servo {one.id}", Verdict.OK, described(one), subject=Subject.HAND)]


def described(one: Surveyed) -> str:
    """Return a one-line description of a servo."""
    if one.model is None:
        return "it answers, and its registers could not be read"
    low, high = one.limits_counts
    return (
        f"{one.kind.name} ({one.model}), firmware {one.firmware[0]}.{one.firmware[1]}, {one.baud} bit/s, "
        f"{one.voltage_v:g} V, {one.temperature_c} °C, at {one.position_counts}, limits {low} to {high}, "
        f"offset {one.offset_counts}"
    )


def small_move(bus: FeetechBus, one: Surveyed, counts: int, wait: Callable[[float], None]) -> Examined:
    """Move a servo by `counts` and back, `TIMES` times, and restore its torque setting.

    Args:
        bus: bus of the servo.
        one: result of `survey`.
        counts: size of the move, 1 to `LARGEST_COUNTS`.
        wait: waits for a number of seconds.

    Raises:
        NoAnswerError, DamagedAnswerError: the servo stopped answering; its torque may be on.
    """
    name = f"servo {one.id} move"
    low, high = one.limits_counts if one.limits_counts != (0, 0) else (0, 4095)
    start = one.position_counts
    there = start + counts if start + counts <= high else start - counts
    if one.status or one.mode or not (low <= start <= high and low <= there):
        return Examined(
            name, Verdict.LOOK, "it was not moved, because of its status, mode or angle limits",
            "put that right first", subject=Subject.HAND,
        )  # fmt: skip
    places: dict[int, list[int]] = {there: [], start: []}
    try:
        for _ in range(TIMES):
            for goal, reached in places.items():
                bus.write(one.id, GOAL, goal.to_bytes(2, one.byte_order))
                wait(WAIT_S)
                reached.append(_position(bus, one))
    finally:
        bus.write(one.id, TORQUE, bytes((one.torque,)))
    # The first round is ignored, because it starts anywhere within the gear play.
    spread = max(max(reached[1:]) - min(reached[1:]) for reached in places.values())
    error = max(abs(place - goal) for goal, reached in places.items() for place in reached[1:])
    travel = abs(sum(places[there][1:]) - sum(places[start][1:])) / (TIMES - 1)
    said = f"comes back within {spread} counts, stays {error} from its goal at most"
    data = {"spread_counts": spread, "error_counts": error, "travel_counts": travel}
    if travel < 0.5 * counts:
        verdict, remedy = Verdict.WRONG, "look for a blocked joint; listen whether its motor turns"
        said = f"moved {travel:.0f} of {counts} counts"
    elif spread > SPREAD_COUNTS or error > STATIC_COUNTS:
        verdict, remedy = Verdict.LOOK, "look for a loose horn, worn gears or a heavy load; compare it with the others"
    else:
        verdict, remedy = Verdict.OK, ""
    return Examined(name, verdict, said, remedy, subject=Subject.HAND, data=data)


def _position(bus: FeetechBus, one: Surveyed) -> int:
    word = int.from_bytes(bus.read(one.id, FEEDBACK, 2).data, one.byte_order)
    return word if one.big_endian or word < 0x8000 else 0x8000 - word
