"""User-supplied files have one door, `aero.regular_file`: no pipe is waited on, and size and depth are bounded."""

import ast
from pathlib import Path

import pytest

from aero.regular_file import MIB, read_json, read_toml

ROOT = Path(__file__).parents[2]
PACKAGES = ("aero", "firmware_emulator", "hil", "model", "train")
READS = {"open", "fdopen", "read_text", "read_bytes", "load", "loadtxt", "genfromtxt", "fromfile"}
MODULES = {"np", "numpy", "lzma", "gzip", "os", "io", "pickle"}
ITS_OWN_WAY = {
    "aero/regular_file.py": "the door",
    "aero/policy/own_process.py": "pipes of its own process",
    "aero/safety/standby.py": "/proc",
    "aero/whole_file.py": "drafts, and what is copied over a mount",
    "firmware_emulator/compare/trace_file.py": "may import nothing of ours; refuses what is not a file",
    "firmware_emulator/firmware/nvs.py": "may import nothing of ours; refuses what is not a file",
    "firmware_emulator/native/build.py": "sources of a compiler, found as files",
    "firmware_emulator/native/sketch.py": "sources of a compiler, found as files",
    "firmware_emulator/servo/model_file.py": "may import nothing of ours; refuses what is not a file",
    "firmware_emulator/links/terminal.py": "pseudo-terminals",
    "hil/checks/__init__.py": "a file of the installation",
    "hil/targets/delays.py": "/proc",
    "hil/verdict/limits.py": "a file of the installation",
    "hil/cli/output.py": "standard streams",
    "hil/cli/doctor/ports.py": "/proc",
    "hil/recordings/provenance.py": "a file of the installation",
    "hil/recordings/output.py": "locks a folder",
    "train/shipped.py": "files of the checkout",
}


def reading(path):
    """Yield the calls of a file that may open a file for reading; resources of the installation are no user's."""
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.Call):
            continue
        called = ast.unparse(node.func)
        name = called.rpartition(".")[2]
        text = ast.unparse(node)
        if name not in READS or "files(" in text or called in ("read_text", "SerialTransport.open", "cls.open"):
            continue
        if name == "load" and called.partition(".")[0] not in MODULES:
            continue
        if name in ("open", "fdopen"):
            modes = [
                one.value for one in (*node.args, *(k.value for k in node.keywords)) if isinstance(one, ast.Constant)
            ]
            if any(isinstance(mode, str) and mode[:1] in "wxa" for mode in modes) or (
                called not in ("open", "os.open", "os.fdopen", "lzma.open", "io.open") and not path_like(called)
            ):
                continue
        yield called


def path_like(called):
    """Return whether `x.open` is of a path: a hand, a bench or a port is opened by the same word."""
    owner = called.rpartition(".")[0].rpartition(".")[2].lower()
    return owner in {"path", "file", "source", "folder", "draft"} or owner.endswith((")", "path", "file"))


def test_nothing_else_opens_a_file_for_reading():
    found = {
        path.relative_to(ROOT).as_posix(): sorted(set(calls))
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if (calls := list(reading(path)))
    }
    assert {name: calls for name, calls in found.items() if name not in ITS_OWN_WAY} == {}


@pytest.mark.parametrize("text", ["NaN", "[Infinity]", "[-Infinity]", "[1e999]", "[" * 100_000, "{", ""])
def test_json_is_finite_and_of_bounded_depth(tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ValueError, match=r".+"):
        read_json(tmp_path / "a.json")


@pytest.mark.parametrize("text", ["a = ", "a = " + "[" * 100_000, "a = {" * 10_000])
def test_toml_is_of_bounded_depth(tmp_path, text):
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(ValueError, match=r".+"):
        read_toml(tmp_path / "a.toml")


@pytest.mark.parametrize("read", [read_json, read_toml])
def test_a_large_file_is_refused_before_it_is_read(tmp_path, read):
    with (tmp_path / "large").open("wb") as file:
        file.truncate(MIB + 1)
    with pytest.raises(OSError, match="bytes"):
        read(tmp_path / "large")
