"""Whatever is wrong with an option, a file, a place or a port: one clear line, the right code, and nothing lost."""

import signal
from pathlib import Path

import pytest
from click.testing import CliRunner
from wrong_inputs import cases, filled, make_files

from hil.cli import main

ALLOWED_CODES = {"option": {2}, "file": {2}, "output": {2}, "device": {2, 3}}
"""Bad usage, or no hand at a port."""


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    return make_files(tmp_path_factory.mktemp("wrong"))


@pytest.fixture(autouse=True)
def _signals_as_before():
    """`emulate` takes them before it looks at anything."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("case", tuple(cases()), ids=lambda case: f"{case.line}-{case.wrong}")
def test_a_wrong_input_gets_one_clear_line(case, names, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = kept(names["IN"])
    arguments = [filled(word, case.wrong, names) for word in case.line.split()]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in ALLOWED_CODES[case.kind], result.output
    assert "Traceback" not in result.output
    errors = [line for line in result.output.splitlines() if line.startswith("Error: ")]
    assert errors == result.output.splitlines()[-1:]
    assert filled(case.named, "", names) in errors[0]
    assert kept(names["IN"]).items() >= before.items()
    assert list(tmp_path.iterdir()) == []


def kept(folder):
    """Every file of a folder, with its size and the time of its last change."""
    return {
        path: (path.lstat().st_size, path.lstat().st_mtime_ns) for path in Path(folder).iterdir() if not path.is_dir()
    }
