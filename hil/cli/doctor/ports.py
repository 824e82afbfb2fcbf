"""Serial ports: which look like the hand, whether this user may use them, who holds one, and how long it waits."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from serial.tools.list_ports import comports

from hil.robots.finding import Examined, Subject, Verdict

HAND_USB = (0x303A, 0x1001)
"""USB vendor and product of the hand's board, an ESP32-S3 with its own USB port."""
UDEV_FILE = "/etc/udev/rules.d/70-aero-hand.rules"
UDEV_RULE = (
    'SUBSYSTEM=="tty", ATTRS{idVendor}=="303a", ATTRS{idProduct}=="1001", MODE="0660", TAG+="uaccess", '
    'ENV{ID_MM_DEVICE_IGNORE}="1"'
)
"""Gives the port to whoever is logged in, and keeps ModemManager from writing to it."""
UDEV_COPY = (
    f"echo '{UDEV_RULE}' | sudo tee {UDEV_FILE}",
    "sudo udevadm control --reload-rules && sudo udevadm trigger --subsystem-match=tty",
)
PSEUDO_TERMINALS = {"/dev/ptmx", "/dev/pts/ptmx"}
"""Open in whoever serves a pseudo-terminal: `aero-hil emulate` is no second master of its own hand."""
MOST_LATENCY_MS = 2
"""More than this adds to each reply of about 2 ms; adapters by FTDI come with 16 ms."""


@dataclass(frozen=True)
class Port:
    """What the system says about one serial port."""

    device: str
    usb: tuple[int, int] | None = None
    """USB vendor and product."""
    serial_number: str = ""
    permitted: bool = True
    """Whether this user may read and write it."""
    group: str = ""
    """Group that owns it, empty where there is none."""
    holders: tuple[str, ...] = ()
    """Programs that have it open, as `name (process ID)`; only those that this user may see."""
    latency_ms: int | None = None
    """Latency timer of the USB adapter; None where it has none."""

    @property
    def looks_like_hand(self) -> bool:
        """Whether it is a board such as the hand's."""
        return self.usb == HAND_USB


def list_ports() -> tuple[Port, ...]:
    """Return the serial ports of this machine."""
    return tuple(
        read_port(found.device, None if found.vid is None else (found.vid, found.pid), found.serial_number or "")
        for found in sorted(comports())
    )


def read_port(device: str, usb: tuple[int, int] | None = None, serial_number: str = "") -> Port:
    """Return what the system says about a port, without opening it."""
    real = os.path.realpath(device)
    permitted = os.access(real, os.R_OK | os.W_OK)
    return Port(device, usb, serial_number, permitted, _group(real), holders(real), _latency_ms(real))


def holders(device: str, processes: Path = Path("/proc")) -> tuple[str, ...]:
    """Return which other programs have a device open; none where the system does not say."""
    return tuple(sorted(_holders(os.path.realpath(device), processes)))


def _holders(device: str, processes: Path) -> Iterator[str]:
    for process in processes.glob("[0-9]*"):
        if process.name == str(os.getpid()):
            continue
        try:
            opened = {os.path.realpath(file) for file in (process / "fd").iterdir()}
            if device in opened and not (device.startswith("/dev/pts/") and opened & PSEUDO_TERMINALS):
                yield f"{(process / 'comm').read_text().strip()} ({process.name})"
        except OSError:  # of another user, or ended meanwhile
            continue


def _group(device: str) -> str:
    try:
        return Path(device).group()
    except (OSError, KeyError, NotImplementedError):
        return ""


def _latency_ms(device: str) -> int | None:
    try:
        return int(Path("/sys/class/tty", Path(device).name, "device/latency_timer").read_text())
    except (OSError, ValueError):
        return None


def check_ports(ports: Sequence[Port], named: str = "") -> Iterator[Examined]:
    """Judge the ports of this machine.

    Args:
        ports: all of them.
        named: the port that was named, which then counts as the hand's.
    """
    hands = [port for port in ports if (port.device == named if named else port.looks_like_hand)]
    shown = ", ".join(port.device for port in hands)
    data = {
        "ports": [{"device": port.device, "usb": list(port.usb or ()), "serial": port.serial_number} for port in ports],
        "hands": [port.device for port in hands],
    }
    if hands:
        found = f"named: {named}" if named else f"looks like a hand: {shown}"
        remedy = "" if named else f"have it asked too: aero-hil doctor --hil {hands[0].device}"
    else:
        why = f"{named} is no port of this machine" if named else "none looks like a hand"
        found = f"{why}; serial ports here: {', '.join(port.device for port in ports) or 'none'}"
        remedy = "plug the hand in, with a cable that carries data; without a hand: aero-hil emulate"
    yield Examined("ports", Verdict.OK, found, remedy, data=data)
    for port in hands:
        yield from check_port(port)


def check_port(port: Port) -> Iterator[Examined]:
    """Judge one port: rights, holders, latency timer."""
    data = {"device": port.device, "group": port.group, "permitted": port.permitted}
    if port.permitted:
        yield Examined("rights", Verdict.OK, f"{port.device} can be read and written", data=data)
    else:
        found = f"{port.device} belongs to the group `{port.group}`, and this user may not use it"
        remedy = f"sudo usermod -aG {port.group or 'dialout'} $USER and log in again; or copy this rule"
        yield Examined("rights", Verdict.WRONG, found, remedy, UDEV_COPY, data=data)
    by = {"device": port.device, "holders": list(port.holders)}
    if port.holders:
        found = f"{port.device} is open in {', '.join(port.holders)}"
        yield Examined("holder", Verdict.LOOK, found, "end it: a hand has one master", subject=Subject.LINK, data=by)
    else:
        yield Examined("holder", Verdict.OK, f"nothing seen that holds {port.device}", subject=Subject.LINK, data=by)
    timer = {"device": port.device, "latency_ms": port.latency_ms}
    if port.latency_ms is None:
        yield Examined("latency", Verdict.OK, f"{port.device} has no latency timer", data=timer)
        return
    slow = port.latency_ms > MOST_LATENCY_MS
    file = f"/sys/class/tty/{Path(os.path.realpath(port.device)).name}/device/latency_timer"
    found = f"{port.device} holds bytes back for up to {port.latency_ms} ms"
    remedy, copy = ("shorten it, until it is unplugged", (f"echo 1 | sudo tee {file}",)) if slow else ("", ())
    yield Examined("latency", Verdict.LOOK if slow else Verdict.OK, found, remedy, copy, data=timer)
