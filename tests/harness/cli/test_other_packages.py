"""Commands that other packages bring: one that is broken costs its own commands, never those of aero-hil."""

import os
import subprocess
import sys

import pytest

TABLE = "from hil.cli.command_table import Command\nCOMMANDS = {{{name!r}: Command({place!r}, 'A summary.')}}\n"
BROKEN = {
    "gone": (None, "ModuleNotFoundError"),
    "raising": ("raise RuntimeError('\x1b[2J')", r"RuntimeError: \x1b[2J"),
    "empty": ("", "AttributeError"),
    "number": ("COMMANDS = 5", "AttributeError"),
    "short": ("COMMANDS = {'mine': ()}", "TypeError"),
    "taking": (TABLE.format(name="validate", place="other_taking:command"), "there is one already"),
}
"""Kind of package to the source of its module, None for no file, and a part of the line that names it."""


def install(folder, name, source):
    """Install a distribution NAME with a table of commands in the module `other_NAME`."""
    facts = folder / f"{name}-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n")
    (facts / "entry_points.txt").write_text(f"[aero_hil.commands]\n{name} = other_{name}:COMMANDS\n")
    if source is not None:
        (folder / f"other_{name}.py").write_text(source)


def run(folder, *arguments):
    return subprocess.run(
        [sys.executable, "-P", "-m", "hil.cli", *arguments], capture_output=True, text=True, check=False, cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder), "COLUMNS": "200"},
    )  # fmt: skip


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    """A folder on Python's path with every broken package, and one of which the metadata cannot be read."""
    folder = tmp_path_factory.mktemp("packages")
    for name, (source, _) in BROKEN.items():
        install(folder, name, source)
    install(folder, "unreadable", "")
    (folder / "unreadable-1.dist-info" / "entry_points.txt").write_bytes(b"[aero_hil.commands]\n\xff = x\n")
    return folder


def test_our_commands_do_as_without_them(beside):
    done = run(beside, "validate", "--only", "presence", "--out", "out")
    assert (done.returncode, (beside / "out" / "report.html").is_file()) == (0, True), done.stderr


@pytest.mark.parametrize("arguments", [["--help"], ["mine"]])
def test_each_is_named_in_a_line(beside, arguments):
    done = run(beside, *arguments)
    assert done.returncode == (0 if arguments == ["--help"] else 2)
    lines = (done.stdout + done.stderr).splitlines()
    for name, (_, said) in BROKEN.items():
        assert sum(f"`{name}`" in line and said in line for line in lines) == 1, (name, lines)
    assert "\x1b" not in done.stdout + done.stderr


COMMANDS = {
    "absent": ("", 2, "ModuleNotFoundError"),
    "fine": ("import click\n@click.command()\ndef command(): print('done')", 0, ""),
}
"""Kind of command to the source of its module, its exit code, and a part of the line."""


@pytest.mark.parametrize("kind", COMMANDS)
def test_a_command_of_another_package_ends_as_its_own(tmp_path, kind):
    source, code, said = COMMANDS[kind]
    install(tmp_path, kind, TABLE.format(name="mine", place="mine_of_another:command"))
    if source:
        (tmp_path / "mine_of_another.py").write_text(source)
    done = run(tmp_path, "mine")
    assert done.returncode == code, done.stderr
    if code:
        assert said in done.stderr.splitlines()[-1]
