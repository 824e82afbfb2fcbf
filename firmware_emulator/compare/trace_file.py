"""Recorded sessions in a file: what happened to a board, and every byte that left it, with its time.

One JSON object a line, one session each, compressed as the name ends (`.xz`, `.gz`). `steps` are those of
`sessions.py`, named by `do`. Events are either pairs `[time in ns, bytes in hex]`, or packed as written here: each
distinct `packet` once, then which one came how long `after_ns` the event before. A board repeats itself, so that
800,000 events take 20 kB.
"""

from __future__ import annotations

import gzip
import json
import lzma
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import accumulate, pairwise
from pathlib import Path
from typing import IO, Any, Literal

from firmware_emulator.compare.run import BUS, HOST, STORE, BoardTrace
from firmware_emulator.compare.sessions import Await, Damage, Heat, Reset, Send, Servos, Session, Step, Wait

STEPS: dict[str, type[Step]] = {
    "send": Send,
    "wait": Wait,
    "await": Await,
    "reset": Reset,
    "damage": Damage,
    "servos": Servos,
    "heat": Heat,
}
ENDINGS = (".jsonl.xz", ".jsonl.gz", ".jsonl")
_NAMES = {kind: name for name, kind in STEPS.items()}
_BYTES = {"data", "before", "replace"}

Events = list[tuple[int, bytes]]


class TraceFileError(ValueError):
    """A file that holds no recorded sessions."""


@dataclass(frozen=True)
class Recorded:
    """A session, and what a board did in it."""

    kind: str
    """Name of the sessions that it belongs to, for example `homing`."""
    session: Session
    trace: BoardTrace


def is_trace_file(name: str) -> bool:
    """Whether a name is that of a file of recorded sessions."""
    return name.endswith(ENDINGS)


def read_traces(path: Path) -> Iterator[Recorded]:
    """Read sessions one after the other.

    Raises:
        TraceFileError: no such file, or something else in it; the message names the line.
    """
    number = 0
    try:
        with _opened(path, "rt") as file:
            for number, line in enumerate(file, start=1):  # noqa: B007 - for the message
                yield _recorded(json.loads(line))
    except (OSError, EOFError, lzma.LZMAError, ValueError, KeyError, TypeError) as error:
        where = f", line {number}" if number else ""
        raise TraceFileError(f"{path}{where}: no recorded sessions ({type(error).__name__}: {error})") from error


def write_traces(path: Path, recorded: Iterable[Recorded]) -> None:
    """Write sessions, packed, in place of what is at `path` when all are written; the folder is there."""
    draft = path.with_name(f".{os.getpid()}.{path.name}")  # this package knows nothing of `aero.whole_file`
    try:
        with _opened(draft, "wt") as file:
            for one in recorded:
                file.write(json.dumps(_object(one), separators=(",", ":")) + "\n")
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _opened(path: Path, mode: Literal["rt", "wt"]) -> IO[str]:
    if path.name.endswith(".xz"):
        return lzma.open(path, mode, encoding="utf-8")
    if path.name.endswith(".gz"):
        return gzip.open(path, mode, encoding="utf-8")
    return path.open(mode, encoding="utf-8")


def _recorded(read: dict[str, Any]) -> Recorded:
    session = Session(
        read["name"],
        read["start"],
        tuple(_step(step) for step in read["steps"]),
        tuple((key, value) for key, value in read["stored"]),
        read["stops"],
    )
    events = {where: _events(read["events"][where]) for where in (HOST, BUS, STORE)}
    return Recorded(read["kind"], session, BoardTrace(events, registers=read["registers"], packets=len(events[BUS])))


def _object(recorded: Recorded) -> dict[str, Any]:
    session = recorded.session
    return {
        "kind": recorded.kind,
        "name": session.name,
        "start": session.start,
        "stored": session.stored,
        "stops": session.stops,
        "steps": [_described(step) for step in session.steps],
        "events": {where: _packed(events) for where, events in recorded.trace.events.items()},
        "registers": recorded.trace.registers,
    }


def _step(read: dict[str, Any]) -> Step:
    given = dict(read)
    kind = STEPS[given.pop("do")]
    for name in _BYTES & given.keys():
        given[name] = None if given[name] is None else bytes.fromhex(given[name])
    if kind is Servos:
        given["present"] = tuple(given["present"])
    return kind(**given)


def _described(step: Step) -> dict[str, Any]:
    values = {field.name: getattr(step, field.name) for field in fields(step)}
    said = {name: value.hex() if isinstance(value, bytes) else value for name, value in values.items()}
    return {"do": _NAMES[type(step)], **said}


def _events(read: Any) -> Events:
    if isinstance(read, list):
        return [(ns, bytes.fromhex(data)) for ns, data in read]
    packets = [bytes.fromhex(data) for data in read["packets"]]
    which = (packets[index] for index in read["packet"])
    return list(zip(accumulate(read["after_ns"]), which, strict=True))


def _packed(events: Events) -> dict[str, Any]:
    index = {data: at for at, data in enumerate(dict.fromkeys(data for _, data in events))}
    times = [0, *(ns for ns, _ in events)]
    return {
        "packets": [data.hex() for data in index],
        "packet": [index[data] for _, data in events],
        "after_ns": [later - earlier for earlier, later in pairwise(times)],
    }
