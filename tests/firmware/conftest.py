"""Firmware programs: ours, and where `AERO_FIRMWARE_SOURCES` names a folder with sources, the real ones."""

import os
from pathlib import Path

import pytest

from firmware_emulator.native.build import FirmwareBuildError, build, choose

SKETCH = Path(__file__).parent / "sketch"


def sources() -> Path | None:
    """Folder with `firmware/VERSION/` and `ftservo/`, None when no one is named."""
    named = os.environ.get("AERO_FIRMWARE_SOURCES")
    return Path(named) if named else None


def pytest_collection_modifyitems(items):
    """Keep the tests of a file on one worker, which compiles once."""
    for item in items:
        if item.path.parent == Path(__file__).parent:
            item.add_marker(pytest.mark.xdist_group(item.path.name))


@pytest.fixture(scope="session")
def compiler():
    try:
        return choose(frozenset())
    except FirmwareBuildError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def program(compiler, tmp_path_factory):
    """Our own sketch."""
    out = tmp_path_factory.mktemp("program") / "sketch"
    build(SKETCH, out)
    return out


@pytest.fixture(scope="session")
def real_program(compiler, tmp_path_factory):
    """Builds a version of the real firmware, each once."""
    folder = tmp_path_factory.mktemp("programs")

    def get(version: str, hand: str) -> Path:
        out = folder / f"{version}-{hand}"
        if not out.exists():
            root = sources()
            build(root / "firmware" / version, out, library=root / "ftservo", side=hand)
        return out

    return get
