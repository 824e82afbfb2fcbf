"""Bundle of a run for a bug report: a zip file without the names of user, home folder and computer.

| member | content |
|---|---|
| `EXPERIMENT.mcap` | recordings, with messages of other programs removed |
| `checks.json`, `case.json` | those of the run, if there are any |
| `bundle.json` | versions, commit, findings of `aero-hil doctor`, recordings that could not be read |
"""

import dataclasses
import getpass
import os
import re
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile

from aero.regular_file import open_regular, read_json
from aero.whole_file import begin_file, whole
from hil.recordings.errors import UnusableFileError, writing
from hil.recordings.mcap_file import read_recording, write_recording
from hil.recordings.output import json_text
from hil.recordings.provenance import OPERATOR, host, source_commit, versions
from hil.recordings.recording import Header, Recording
from hil.verdict.baseline import LARGEST_BYTES
from hil.verdict.case_file import CASE

FORMAT = 1
MOST_BYTES = 2**30
"""Limit of the unpacked size of a bundle, bytes; a run of 200 s has 10 MB."""
HOMES = re.compile(r"(?:[A-Za-z]:)?[/\\]+(?:home|Users)[/\\]+[^/\\\s'\",;:]+")
"""Pattern of any home folder, such as that of the operator on another computer."""
FREE_TEXT = {"note", "answers", "hand_id", "unit", "target", "command"}
"""Keys of a case whose texts are not from a fixed vocabulary."""
DAMAGED = (BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError)
"""Exceptions that a damaged or foreign zip file raises."""

Scrub = Callable[[str], str]


def scrubber(headers: Iterable[Header]) -> Scrub:
    """Return a function that replaces names of user, home folder and computer, of here and of `headers`."""
    users, hosts, homes = set[str](), {host()}, set[str]()
    with suppress(OSError, KeyError):  # no such user, as in some containers
        users.add(getpass.getuser())
    users |= {os.environ.get(name, "") for name in ("USER", "LOGNAME", "USERNAME", OPERATOR)}
    with suppress(RuntimeError):  # a user without a home folder
        homes.add(str(Path.home()))
    for header in headers:
        users.add(header.operator)
        hosts.add(header.host)
    hosts |= {name.partition(".")[0] for name in hosts}
    rules = [(re.escape(home), "~") for home in homes if len(home) > 1] + [(HOMES.pattern, "~")]
    for names, substitute in ((hosts, "COMPUTER"), (users, "USER")):
        # The longest first, because a name may begin with another.
        longest = sorted(filter(None, names), key=len, reverse=True)
        rules += [(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", substitute) for name in longest]

    def scrub(text: str) -> str:
        for pattern, substitute in rules:
            text = re.sub(pattern, substitute, text, flags=re.IGNORECASE)
        return text

    return scrub


def write_bundle(folder: Path, names: Collection[str], path: Path, doctor: Sequence[Mapping[str, Any]]) -> list[str]:
    """Write the bundle of a run; return a line for each recording that is left out.

    Args:
        folder: folder of the run.
        names: experiments whose recordings are included.
        path: zip file to write.
        doctor: findings of `aero-hil doctor`, JSON-compatible.

    Raises:
        CannotBeWrittenError: the file cannot be written.
    """
    recordings: dict[str, Recording] = {}
    left_out: list[str] = []
    for name in names:
        with suppress(FileNotFoundError):
            try:
                recordings[f"{name}.mcap"] = read_recording(folder / f"{name}.mcap")
            except UnusableFileError as error:
                left_out.append(str(error))
    scrub = scrubber(recording.header for recording in recordings.values())
    about = {"format": FORMAT, "versions": versions(), "commit": source_commit(), "doctor": doctor}
    with writing(path), whole(path) as draft, TemporaryDirectory() as place, ZipFile(draft, "x", ZIP_DEFLATED) as made:
        for name, recording in recordings.items():
            write_recording(_anonymous(recording, scrub), Path(place, name))
            made.write(Path(place, name), name)
        for name, keys in (("checks.json", None), (CASE, FREE_TEXT)):
            with suppress(OSError, ValueError):  # a run that ended early has none
                made.writestr(name, json_text(_scrubbed(read_json(folder / name, LARGEST_BYTES), scrub, keys)))
        made.writestr("bundle.json", json_text(_scrubbed(about | {"left_out": left_out}, scrub, None)))
    return left_out


def _scrubbed(content: Any, scrub: Scrub, keys: Collection[str] | None) -> Any:
    """Return JSON content with its texts scrubbed: all texts, or those below `keys`."""
    if isinstance(content, Mapping):
        return {
            name: _scrubbed(value, scrub, None if keys is None or name in keys else keys)
            for name, value in content.items()
        }
    if isinstance(content, list | tuple):
        return [_scrubbed(value, scrub, keys) for value in content]
    return scrub(content) if isinstance(content, str) and keys is None else content


def _anonymous(recording: Recording, scrub: Scrub) -> Recording:
    """Return a recording without personal names in header and events."""
    header = recording.header
    # A word such as `reference` may be somebody's name too, so units and targets are scrubbed as paths only.
    unit, target = (scrub(text) if re.search(r"[/\\]", text) else text for text in (header.unit, header.target))
    named = {name: scrub(value) if isinstance(value, str) else value for name, value in header.parameters.items()}
    return dataclasses.replace(
        recording,
        header=dataclasses.replace(
            header,
            host="",
            operator="",
            command=scrub(header.command),
            hand_id=scrub(header.hand_id),
            unit=unit,
            target=target,
            parameters=named,
        ),
        events=tuple(dataclasses.replace(event, text=scrub(event.text)) for event in recording.events),
    )


@contextmanager
def unpacked(path: Path, names: Collection[str]) -> Iterator[Path]:
    """Yield a temporary folder with the recordings of a bundle; other members are not unpacked.

    Raises:
        OSError: the file cannot be read, or is a pipe or a device.
        UnusableFileError: not a zip file, damaged, or too large; the message names it.
    """
    with TemporaryDirectory() as place:
        with open_regular(path) as stream:
            try:
                with ZipFile(stream) as archive:
                    wanted = [
                        info for info in archive.infolist() if info.filename in {f"{name}.mcap" for name in names}
                    ]
                    if sum(info.file_size for info in wanted) > MOST_BYTES:
                        raise UnusableFileError(f"{path} unpacks to more than {MOST_BYTES >> 20} MiB")
                    for info in wanted:
                        with begin_file(Path(place, info.filename)) as file:
                            file.write(archive.read(info))
            except UnusableFileError:
                raise
            except DAMAGED as error:
                raise UnusableFileError(f"{path} is not a readable bundle: {type(error).__name__} {error}") from error
        yield Path(place)
