"""Seeded bugs of the real firmware are caught: by the comparison with the emulated one, or by a sanitizer."""

import shutil

import pytest

from firmware_emulator.compare.run import Contender, compare, contender
from firmware_emulator.compare.sessions import sessions
from firmware_emulator.native.build import build
from firmware_emulator.native.program import FirmwareProgramError
from tests.firmware.conftest import sources
from tests.firmware.seeded_bugs import BUGS

VERSION = "0.2.0"
SEEDS = range(3)

if sources() is None or not (sources() / "firmware" / VERSION).is_dir():
    pytest.skip(f"AERO_FIRMWARE_SOURCES names no folder with firmware/{VERSION}", allow_module_level=True)
pytestmark = pytest.mark.slow


def seeded(bug, folder, **options):
    source = folder / "source"
    shutil.copytree(sources() / "firmware" / VERSION, source)
    path = source / bug.file
    path.chmod(0o644)
    text = path.read_text(encoding="utf-8")
    assert text.count(bug.old) == 1, f"{bug.name}: {text.count(bug.old)} places"
    path.write_text(text.replace(bug.old, bug.new), encoding="utf-8")
    build(source, folder / "program", library=sources() / "ftservo", hand="right", **options)
    return Contender("seeded", "right", VERSION, folder / "program")


def found_by(names, firmware):
    """What the sessions say first: a difference or the end of the program; None when nothing."""
    for name in names:
        for seed in SEEDS:
            for session in sessions(name, seed):
                try:
                    difference = compare(session, contender(VERSION, "right"), firmware).difference
                except FirmwareProgramError as error:
                    return str(error)
                if difference is not None:
                    return difference
    return None


@pytest.mark.parametrize("bug", [bug for bug in BUGS if bug.session is not None], ids=lambda bug: bug.name)
def test_the_comparison_shows_it(compiler, bug, tmp_path):
    assert found_by([bug.session], seeded(bug, tmp_path)) is not None


@pytest.mark.parametrize("bug", [bug for bug in BUGS if bug.sanitizer is not None], ids=lambda bug: bug.name)
def test_a_sanitizer_stops_it_with_its_line(compiler, bug, tmp_path):
    said = found_by(["opcodes"], seeded(bug, tmp_path, sanitize=[bug.sanitizer]))
    assert isinstance(said, str)
    assert f"{bug.file}:" in said
