"""Bundle of a run for a bug report: a zip file without personal details, such as names, homes, computers, addresses.

| member | content |
|---|---|
| `EXPERIMENT.mcap`, `step-N/EXPERIMENT.mcap` | recordings of the run and of the reruns of its case |
| `checks.json`, `case.json`, `step-N/checks.json` | those of the run, if there are any |
| `case.html` | page of the case, made from the case of the bundle |
| `bundle.json` | versions, commit, findings of `aero-hil doctor`, recordings that could not be read |

Fields of a recording's header are kept by a list; of all texts only words of this program remain.
"""

import dataclasses
import re
import shutil
import zlib
from collections.abc import Collection, Iterator, Mapping, Sequence
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
from hil.recordings.provenance import source_commit, versions
from hil.recordings.recording import Header, Recording
from hil.report.anonymous import Scrub, known_words, scrubbed, scrubber
from hil.report.page import render_case
from hil.report.run_folder import CASE_PAGE
from hil.targets.hands_file import EMULATED_TARGETS
from hil.verdict.baseline import LARGEST_BYTES
from hil.verdict.case_file import CASE, STEP, case_of

FORMAT = 2
LEAST_ROOM, MOST_TIMES = 2**21, 2
"""Limit of the unpacked size of a bundle: the larger of 2 MiB and twice the file size; recordings are compressed."""
KEPT = {
    "experiment", "side", "firmware", "map", "window", "seed", "safety", "commit", "started", "duration_s", "finished",
}  # fmt: skip
"""Fields of a header that are kept as they are; their values are numbers, dates or of a fixed vocabulary."""
FREE_TEXT = {"note", "answers", "hand_id", "serial_number", "unit", "target", "command", "baseline", "firmware_program"}
"""Keys of JSON files whose texts a person or a computer has named."""
DAMAGED = (BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError)
"""Exceptions that a damaged or foreign zip file raises."""


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
    steps = sorted(path.name for path in folder.glob(STEP.format("[0-9]*")) if path.is_dir())
    for place in ("", *(f"{step}/" for step in steps)):
        for name in names:
            with suppress(FileNotFoundError):
                try:
                    recordings[f"{place}{name}.mcap"] = read_recording(folder / f"{place}{name}.mcap")
                except UnusableFileError as error:
                    left_out.append(str(error))
    scrub = scrubber(recording.header for recording in recordings.values())
    about = {"format": FORMAT, "commit": source_commit(), "versions": versions()}
    said = {"doctor": _lines(doctor, scrub), "left_out": _lines(left_out, scrub)}
    with writing(path), whole(path) as draft, TemporaryDirectory() as place, ZipFile(draft, "x", ZIP_DEFLATED) as made:
        for name, recording in recordings.items():
            write_recording(_anonymous(recording, scrub), Path(place, "recording.mcap"))
            made.write(Path(place, "recording.mcap"), name)
        for name in ("checks.json", CASE, *(f"{step}/checks.json" for step in steps)):
            with suppress(OSError, ValueError):  # a run that ended early has none
                made.writestr(name, json_text(scrubbed(read_json(folder / name, LARGEST_BYTES), scrub, FREE_TEXT)))
        with suppress(KeyError, ValueError, TypeError, AttributeError):  # no case of this version
            case = case_of(scrubbed(read_json_or_none(folder / CASE), scrub, FREE_TEXT))
            made.writestr(CASE_PAGE, render_case(case))
        made.writestr("bundle.json", json_text(about | said))
    return left_out


def read_json_or_none(path: Path) -> Any:
    """Return the content of a JSON file, or None without one."""
    try:
        return read_json(path, LARGEST_BYTES)
    except OSError:
        return None


def _lines(content: Any, scrub: Scrub) -> Any:
    """Return JSON content with every text below it scrubbed."""
    return scrubbed({"note": content}, scrub, FREE_TEXT)["note"]


def _anonymous(recording: Recording, scrub: Scrub) -> Recording:
    """Return a recording without personal details in header and events."""
    header = recording.header
    texts = {name: scrub(value) if isinstance(value, str) else value for name, value in header.parameters.items()}
    kept = {name: getattr(header, name) for name in KEPT}
    made = Header(
        **kept,
        target=header.target if header.target in EMULATED_TARGETS else "port",
        unit=scrub(header.unit),
        hand_id=scrub(header.hand_id),
        faults=known_words(header.faults),
        command=scrub(header.command),
        parameters=texts,
        versions={known_words(name): _version(version) for name, version in header.versions.items()},
    )
    events = tuple(dataclasses.replace(event, text=scrub(event.text)) for event in recording.events)
    return dataclasses.replace(recording, header=made, events=events)


def _version(text: str) -> str:
    """Return a version without its local part, such as a folder or a user."""
    return found[0] if (found := re.match(r"\d[\d.]*(?:rc\d+|[ab]\d+)?", text)) else known_words(text)


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
                    room = max(LEAST_ROOM, MOST_TIMES * path.stat().st_size)
                    # The index alone: a member's data end at the size that it claims.
                    if sum(info.file_size for info in wanted) > room:
                        raise UnusableFileError(f"{path} unpacks to more than {room} bytes")
                    for info in wanted:
                        with begin_file(Path(place, info.filename)) as file, archive.open(info) as member:
                            shutil.copyfileobj(member, file)
            except UnusableFileError:
                raise
            except DAMAGED as error:
                raise UnusableFileError(f"{path} is not a readable bundle: {type(error).__name__} {error}") from error
        yield Path(place)
