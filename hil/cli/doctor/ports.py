"""Examination of serial ports and of a hand at rest, without motion or register writes."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from serial.tools.list_ports import comports

from aero import UNSHIFTED, AeroHand, Channel, CommandWindow
from aero.actuation.window import fits_span
from aero.errors import AeroError
from aero.firmware import DEFAULT_FIRMWARE, FIRMWARE
from aero.protocol import MAX_CODE, Opcode
from hil.cli.doctor.finding import Examined, Subject, Verdict
from hil.targets.boot_text import identify

HAND_USB = (0x303A, 0x1001)
"""USB vendor and product of the hand's board, an ESP32-S3 with native USB."""
UDEV_FILE = "/etc/udev/rules.d/70-aero-hand.rules"
UDEV_RULE = (
    'SUBSYSTEM=="tty", ATTRS{idVendor}=="303a", ATTRS{idProduct}=="1001", MODE="0660", TAG+="uaccess", '
    'ENV{ID_MM_DEVICE_IGNORE}="1"'
)
"""Rule that grants the port to the logged-in user and keeps ModemManager from writing to it."""
UDEV_COPY = (
    f"echo '{UDEV_RULE}' | sudo tee {UDEV_FILE}",
    "sudo udevadm control --reload-rules && sudo udevadm trigger --subsystem-match=tty",
)
PSEUDO_TERMINALS = {"/dev/ptmx", "/dev/pts/ptmx"}
"""Files open in any server of a pseudo-terminal; they exempt `aero-hil emulate` from the check for a second master."""
SPANS = UNSHIFTED.spans_counts()
"""Width of each channel's command window after homing, (7,) counts, identical for every firmware and side."""
RESTARTED = CommandWindow.for_firmware(DEFAULT_FIRMWARE, "mixed")
"""Windows of firmware 0.2.0 after a restart without homing, in which the thumb's widths differ."""


@dataclass(frozen=True)
class Port:
    """System data of one serial port."""

    device: str
    usb: tuple[int, int] | None = None
    """USB vendor and product."""
    serial_number: str = ""
    permitted: bool = True
    """Whether this user may read and write the port."""
    group: str = ""
    """Group that owns the port, or ""."""
    server: str = ""
    """Account that serves a pseudo-terminal; "" for a port of a device."""
    holders: tuple[str, ...] = ()
    """Programs that have the port open, as `name (process ID)`, as far as visible to this user."""


def examine_port(named: str) -> Iterator[Examined]:
    """Yield the findings on the ports, and on the hand at the port `named`, if any."""
    ports = [
        _read_port(found.device, None if found.vid is None else (found.vid, found.pid), found.serial_number or "")
        for found in sorted(comports())
    ]
    if named and all(port.device != named for port in ports) and Path(named).exists():
        ports.append(_read_port(named))
    yield from check_ports(ports, named)
    if named:
        yield from check_hand(named, holders(named))


def _read_port(device: str, usb: tuple[int, int] | None = None, serial_number: str = "") -> Port:
    """Return the system data of a port, without opening it."""
    real = os.path.realpath(device)
    try:
        group, owner = Path(real).group(), Path(real).owner()
    except (OSError, KeyError, NotImplementedError):
        group = owner = ""
    server = owner if real.startswith("/dev/pts/") else ""
    return Port(device, usb, serial_number, os.access(real, os.R_OK | os.W_OK), group, server, holders(real))


def holders(device: str) -> tuple[str, ...]:
    """Return the other programs that have a device open; none if the system does not report them."""
    device, found = os.path.realpath(device), []
    for process in Path("/proc").glob("[0-9]*"):
        if process.name == str(os.getpid()):
            continue
        try:
            opened = {os.path.realpath(file) for file in (process / "fd").iterdir()}
            if device in opened and not (device.startswith("/dev/pts/") and opened & PSEUDO_TERMINALS):
                found.append(f"{(process / 'comm').read_text().strip()} ({process.name})")
        except OSError:  # of another user, or ended meanwhile
            continue
    return tuple(sorted(found))


def check_ports(ports: Sequence[Port], named: str = "") -> Iterator[Examined]:
    """Judge the ports of this machine; the named port counts as the hand's."""
    hands = [port for port in ports if (port.device == named if named else port.usb == HAND_USB)]
    data = {
        "ports": [{"device": port.device, "usb": list(port.usb or ()), "serial": port.serial_number} for port in ports],
        "hands": [port.device for port in hands],
    }
    if "://" in named:
        found, remedy = f"named: {named}, over the network", ""
    elif named and hands:
        found, remedy = f"named: {named}", ""
    elif hands:
        found = f"looks like a hand: {', '.join(port.device for port in hands)}"
        remedy = f"query it too: aero-hil doctor --hil {hands[0].device}"
    else:
        why = f"{named} is not a port of this machine" if named else "none looks like a hand"
        found = f"{why}; serial ports here: {', '.join(port.device for port in ports) or 'none'}"
        remedy = "plug the hand in, with a cable that carries data; without a hand: aero-hil emulate"
    yield Examined("ports", Verdict.OK, found, remedy, data=data)
    for port in hands:
        yield from _check_port(port)


def _check_port(port: Port) -> Iterator[Examined]:
    """Judge the permissions and holders of one port."""
    device = port.device
    data = {"device": device, "group": port.group, "permitted": port.permitted}
    if port.permitted:
        yield Examined("rights", Verdict.OK, f"{device} can be read and written", data=data)
    elif port.server:
        found = f"{device} is a pseudo-terminal of the account `{port.server}`, and this user may not use it"
        yield Examined("rights", Verdict.WRONG, found, "serve and use the hand under one account", data=data)
    else:
        found = f"{device} belongs to the group `{port.group}`, and this user may not use it"
        remedy = f"sudo usermod -aG {port.group or 'dialout'} $USER and log in again; or copy this rule"
        yield Examined("rights", Verdict.WRONG, found, remedy, UDEV_COPY, data=data)
    verdict, found, remedy = Verdict.OK, f"nothing seen that holds {device}", ""
    if port.holders:
        verdict, remedy = Verdict.LOOK, "end it: a hand has one master"
        found = f"{device} is open in {', '.join(port.holders)}"
    data = {"device": device, "holders": list(port.holders)}
    yield Examined("holder", verdict, found, remedy, subject=Subject.LINK, data=data)


@dataclass(frozen=True)
class Answers:
    """Answers of a board."""

    codes: tuple[int, ...]
    """Position codes, command order."""
    knows_limits: bool
    knows_calibrate_mid: bool
    boot_text: str


def ask(port: str) -> Answers:
    """Read a hand at rest.

    Raises:
        AeroError: no answer, or not that of a hand.
        ConnectionError: the port cannot be opened, or is lost.
        ValueError: an address that pyserial does not support.
    """
    with AeroHand.open_unguarded(port) as hand:
        codes = tuple(hand.read_codes().tolist())
        return Answers(codes, hand.knows(Opcode.SET_TOR), hand.knows(Opcode.CALIBRATE_MID), hand.boot_text)


def _busy() -> str:
    """Return a prefix for hand faults that blames a busy computer; empty on an idle one."""
    load, cores = _load()
    if load <= cores:
        return ""
    said = f"this computer is busy (load {load:.0f} on {cores} cores), which may be the only cause"
    return f"{said}: stop other programs and try again. Otherwise: "


def _load() -> tuple[float, int]:
    """Return the load average (0 if unknown) and the number of cores."""
    cores = os.cpu_count() or 1
    return (os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0), cores


def check_hand(port: str, held_by: Sequence[str] = ()) -> Iterator[Examined]:
    """Query a hand and judge its answers; skip a port that another program holds."""
    answers: Answers | None = None
    verdict, found, remedy = Verdict.OK, f"a hand answers at {port}", ""
    try:
        if held_by:
            verdict, remedy = Verdict.WRONG, "end that program first"
            found = f"not asked: {port} is open in {', '.join(held_by)}"
        else:
            answers = ask(port)
    except (AeroError, ConnectionError, ValueError) as error:
        # a port that cannot be opened was not asked, so that no reply was late
        verdict, found = Verdict.WRONG, f"{_busy() if isinstance(error, AeroError) else ''}{error}"
        remedy = "look at the lines about the port above; then supply, cable, and whether this is the hand's port"
        if port.startswith("socket://"):
            url = port.replace("socket", "rfc2217", 1)
            remedy = f"try {url}: a port that is served with DTR and RTS is not a raw one; then {remedy}"
    data = {"answers": None if held_by else answers is not None}
    yield Examined("answer", verdict, found, remedy, subject=Subject.LINK, data=data)
    if answers is not None:
        yield check_firmware(answers)
        yield check_calibration(answers.codes)


def candidates(answers: Answers) -> tuple[str, ...]:
    """Return the firmware versions consistent with the answers."""
    possible = tuple(
        version
        for version, row in FIRMWARE.items()
        if (row.settings is not None, row.calibrate_mid) == (answers.knows_limits, answers.knows_calibrate_mid)
    )
    if printed := identify(answers.boot_text).versions:
        possible = tuple(version for version in possible if version in printed)
    if restarted(answers.codes):
        possible = tuple(version for version in possible if "mixed" in FIRMWARE[version].calibration_states)
    return possible


def check_firmware(answers: Answers) -> Examined:
    """Report the versions consistent with the board's behaviour, including those that cannot be told apart at rest."""
    versions = candidates(answers)
    data = {
        "versions": list(versions),
        "knows_limits": answers.knows_limits,
        "knows_calibrate_mid": answers.knows_calibrate_mid,
    }
    verdict, found, remedy = Verdict.OK, f"behaves like {' or '.join(versions)}", ""
    if not versions:
        verdict, found = Verdict.LOOK, "it behaves like none of the known versions"
        remedy = "flash a published version, and home the hand"
    elif len(versions) > 1:
        remedy = "give the flashed one as --firmware; these answer alike, and no board reports its own"
    return Examined("firmware", verdict, found, remedy, subject=Subject.HAND, data=data)


def restarted(codes: Sequence[int]) -> bool:
    """Return whether the thumb's windows are those of firmware 0.2.0 or `main` after a restart without homing."""
    here, homed = fits_span(codes, RESTARTED.spans_counts()), fits_span(codes, SPANS)
    changed = RESTARTED.spans_counts() != SPANS
    return bool((here & ~homed)[changed].all())


def check_calibration(codes: Sequence[int]) -> Examined:
    """Judge from one reading whether the command windows are those after homing.

    Nearly every reading reveals a window of another width; no reading reveals a shifted window of equal width.
    """
    odd = [channel.label for channel in Channel if not fits_span(codes[channel], SPANS[channel])]
    at_end = [channel.label for channel in Channel if codes[channel] in (0, MAX_CODE)]
    data = {"codes": list(codes), "odd": odd, "at_end": at_end, "restarted": restarted(codes)}
    if odd:
        why = "firmware 0.2.0 restarted without homing" if restarted(codes) else "trimmed, or not homed"
        found = f"windows other than after homing ({why}): {', '.join(odd)}"
        remedy = "home the hand: free it, then switch its supply off and on, or call home()"
        return Examined("calibration", Verdict.LOOK, found, remedy, subject=Subject.HAND, data=data)
    found = "the windows are as wide as after homing"
    if at_end:
        found += f"; not told for a channel at an end of its window: {', '.join(at_end)}"
    if len(at_end) == len(codes):
        found = "not told, because each channel is at an end of its window, as in an open hand"
    remedy = "for this hand's own figures: aero-hil record, then aero-hil calibrate"
    return Examined("calibration", Verdict.OK, found, remedy, subject=Subject.HAND, data=data)
