"""The emulated firmware against the real one, where `AERO_FIRMWARE_SOURCES` names its sources."""

import pytest

from firmware_emulator.compare.run import Contender, compare, contender
from firmware_emulator.compare.sessions import MAKERS, sessions
from tests.firmware.conftest import sources

SEED = 11
QUICK = [("0.2.0", "right"), ("0.1.1", "left")]
"""What a run of three minutes can afford."""
SHORT = [name for name in MAKERS if name not in {"homing", "boot", "set_id"}]


def versions() -> list[str]:
    root = sources()
    return sorted(path.name for path in (root / "firmware").iterdir() if path.is_dir()) if root is not None else []


if not versions():
    pytest.skip("AERO_FIRMWARE_SOURCES names no folder with firmware/VERSION and ftservo", allow_module_level=True)


def check(name, version, hand, path):
    for session in sessions(name, SEED):
        outcome = compare(session, contender(version, hand), Contender(hand, version, path))
        assert outcome.difference is None, "\n".join(outcome.difference.lines((version, "real")))


@pytest.mark.parametrize("name", SHORT)
@pytest.mark.parametrize(("version", "hand"), QUICK)
def test_a_part_of_the_sessions(real_program, version, hand, name):
    if version not in versions():
        pytest.skip(f"no source of {version}")
    check(name, version, hand, real_program(version, hand))


@pytest.mark.slow
@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("version", versions())
def test_every_session_of_every_version(real_program, version, hand, name):
    check(name, version, hand, real_program(version, hand))
