"""`hands.toml`: names for hands, so that `--hil bench-left` selects port, firmware, side and thresholds.

The file is in the working folder or in the user's configuration folder, and contains data only, no code.
"""

import os
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from aero.firmware import firmware_of
from aero.regular_file import read_text
from aero.side import Side
from aero.whole_file import write_whole
from aero_hil_toml import filled, meant, parsed

FILE = "hands.toml"
EMULATED_TARGETS = ("emulated", "pty")
"""Targets that are emulated hands."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
PORT = re.compile(r"[/\\]|://|^COM\d+$", re.IGNORECASE)
"""Pattern that distinguishes the path or URL of a port from a name."""


@dataclass(frozen=True)
class HandEntry:
    """Table of a hand; None for a missing key."""

    port: str
    firmware: str | None = None
    side: Side | None = None
    twin: str | None = None
    baseline: str | None = None
    thresholds: dict[str, float] | None = None
    forbidden: list[dict[str, dict[str, float]]] | None = None

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            if value == "":
                raise ValueError(f"`{key}` is empty")
        if self.firmware is not None:
            firmware_of(self.firmware)


Fields = dict[str, Any]
"""Values of some fields of `hil.targets.hand_spec.PortSpec`, by name."""


def fields_of(target: str) -> Fields:
    """Return the fields for a name (from the first file that has it), a port or an emulated hand.

    Raises:
        ValueError: an error in a file, or neither a known name nor an existing port.
    """
    if target in EMULATED_TARGETS or PORT.search(target):
        return {"port": target}
    known: dict[str, Fields] = {}
    for path in files():
        known = read_hands(path) | known
    if target in known:
        return known[target]
    if os.path.lexists(target):
        return {"port": target}
    there = f"{', '.join(known)} of {FILE}" if known else f"no name, as there is no {FILE} here"
    raise ValueError(
        f"no hand is called {target!r}; {meant(target, [*known, *EMULATED_TARGETS])}"
        f"known are `emulated`, `pty`, the path or pyserial URL of a port "
        f"(/dev/ttyACM0, COM3, socket://HOST:PORT), and {there}"
    )


def fields_at(port: str, hand_id: str) -> Fields:
    """Return the fields of the hand on a port: those of its name, if `hands.toml` gives the name this port.

    Raises:
        ValueError: as for `fields_of`.
    """
    said = fields_of(port)
    with suppress(ValueError):
        named = fields_of(hand_id)
        if named.get("hand_id") == hand_id and os.path.realpath(named["port"]) == os.path.realpath(said["port"]):
            return named
    return said


def called(port: str, hand_id: str) -> str:
    """Return the value of `--hil` for a hand: its name, if `hands.toml` has it here, else its port."""
    if not _may_name(hand_id):
        return port
    with suppress(ValueError):
        return hand_id if fields_of(hand_id).get("hand_id") == hand_id else port
    return port


def files() -> tuple[Path, ...]:
    """Return the existing files, the one of the working folder first."""
    folder = user_folder()
    places = (Path(FILE), *(() if folder is None else (folder / FILE,)))
    return tuple(path for path in places if path.is_file())


def user_folder() -> Path | None:
    """Return the user's configuration folder, existing or not; None for a user without a home folder."""
    if sys.platform == "win32":
        base = os.environ.get("APPDATA", "")
    else:
        base = os.environ.get("XDG_CONFIG_HOME", "")
    try:
        return Path(base or Path.home() / ".config") / "aero-hil"
    except RuntimeError:  # a container's or a service's user may have none
        return None


def read_hands(path: Path) -> dict[str, Fields]:
    """Return the hands of a file by name; paths in the file are relative to its folder.

    Raises:
        ValueError: the file cannot be read, is not TOML, or has an invalid key or value.
    """
    try:
        tables = parsed(read_text(path), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from error
    return {name: _hand(path, name, table) for name, table in tables.items()}


def _hand(path: Path, name: str, table: Any) -> Fields:
    where = f"{path}, [{name}]"
    if not isinstance(table, dict):
        raise ValueError(
            f"{path}: `{name}` stands outside a table; begin each hand with its name, such as [bench-left]"
        )
    if not _may_name(name):
        raise ValueError(f"{where}: a name is made of letters, digits, - and _, and is not that of a port")
    said = {key: value for key, value in vars(filled(HandEntry, table, where)).items() if value is not None}
    fields = {"hand_id": name, **said}
    if fields.get("twin", "").endswith(".toml"):
        fields["twin"] = str(path.parent / fields["twin"])
    if "baseline" in fields:
        fields["baseline"] = path.parent / fields["baseline"]
    regions = fields.pop("forbidden", [])
    if "thresholds" in fields or regions:
        from aero.safety import Region, Thresholds  # noqa: PLC0415 - help is quick

        limits = filled(Thresholds, fields.get("thresholds", {}), f"{where}.thresholds")
        try:
            fields["thresholds"] = replace(limits, forbidden=tuple(map(Region.of, regions)))
        except ValueError as error:
            raise ValueError(f"{where}.forbidden: {error}") from error
    return fields


def _may_name(name: str) -> bool:
    return bool(NAME.fullmatch(name)) and name not in EMULATED_TARGETS and not PORT.search(name)


def refuse_taken(name: str, path: Path = Path(FILE)) -> None:
    """Check that a hand can be added to a file under this name.

    Raises:
        ValueError: the name is invalid or already in the file, or the file has an error.
    """
    if not _may_name(name):
        raise ValueError(f"{name!r} cannot name a hand; use letters, digits, - and _, such as bench-left")
    if path.exists() and name in read_hands(path):
        raise ValueError(f"{path} has [{name}] already; choose another name, or edit the file")


def add_hand(
    name: str, port: str, versions: Sequence[str], path: Path = Path(FILE), *, side: Side | None = None
) -> None:
    """Append a hand to a file; the existing content stays.

    One matching firmware version is written as the value, several as a comment; so is an unknown side.

    Raises:
        ValueError: as for `refuse_taken`.
        OSError: the file cannot be written.
    """
    import tomli_w  # noqa: PLC0415 - help is quick

    refuse_taken(name, path)
    before = read_text(path).rstrip("\n") + "\n\n" if path.exists() else ""
    table = (
        {"port": port} | ({"firmware": versions[0]} if len(versions) == 1 else {}) | ({"side": side} if side else {})
    )
    notes = [] if side else ['# side = "left"  # no board says its side']
    if len(versions) > 1:
        notes.insert(0, f'# firmware = "{versions[-1]}"  # name the flashed one: {", ".join(versions)} answer alike')
    write_whole(path, before + tomli_w.dumps({name: table}) + "".join(f"{note}\n" for note in notes))
