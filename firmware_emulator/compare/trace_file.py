"""File of recorded sessions: the steps of each session and every byte from the board, with its time.

Compressed JSON lines, one session each. `steps` are those of `sessions.py`, named by `do`. Events are packed: `packets`
lists each distinct packet once; `packet` and `after_ns` give the index and delay of each event. 800,000 events take
20 kB, because boards repeat their packets.
"""

import json
import lzma
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any, get_args

from firmware_emulator.compare.run import BUS, HOST, STORE, BoardTrace
from firmware_emulator.compare.sessions import Servos, Session, Step

STEPS: dict[str, type[Step]] = {kind.__name__.lower(): kind for kind in get_args(Step)}
ENDING = ".jsonl.xz"
"""File name suffix of recorded sessions."""
_BYTES = {"data", "before", "replace"}

Events = list[tuple[int, bytes]]


class TraceFileError(ValueError):
    """File without valid recorded sessions."""


@dataclass(frozen=True)
class Recorded:
    """Session with the recorded output of a board."""

    kind: str
    """Name of the session maker, for example `homing`."""
    session: Session
    trace: BoardTrace


def read_traces(path: Path) -> Iterator[Recorded]:
    """Yield the sessions of a file.

    Raises:
        TraceFileError: the file is missing or invalid; the message names the line.
    """
    number = 0
    if path.exists() and not path.is_file():
        raise TraceFileError(f"{path}: not a regular file")
    try:
        with lzma.open(path, "rt", encoding="utf-8") as file:
            for number, line in enumerate(file, start=1):  # noqa: B007 - for the message
                yield _recorded(json.loads(line))
    except (OSError, EOFError, lzma.LZMAError, ValueError, KeyError, TypeError, RecursionError) as error:
        where = f", line {number}" if number else ""
        raise TraceFileError(f"{path}{where}: no recorded sessions ({type(error).__name__}: {error})") from error


def write_traces(path: Path, recorded: Iterable[Recorded]) -> None:
    """Write packed sessions to a draft, then replace `path`; its folder must exist."""
    draft = path.with_name(f".{os.getpid()}.{path.name}")  # independent of `aero.whole_file`
    try:
        with lzma.open(draft, "wt", encoding="utf-8") as file:
            for one in recorded:
                file.write(json.dumps(_object(one), separators=(",", ":")) + "\n")
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _recorded(read: dict[str, Any]) -> Recorded:
    session = Session(
        read["name"],
        tuple(_step(step) for step in read["steps"]),
        read["start"],
        tuple((key, value) for key, value in read["stored"]),
        read["stops"],
    )
    events = {where: _events(read["events"][where]) for where in (HOST, BUS, STORE)}
    return Recorded(read["kind"], session, BoardTrace(events, registers=read["registers"]))


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
    return {"do": type(step).__name__.lower(), **said}


def _events(read: dict[str, Any]) -> Events:
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
