"""No command writes over what it reads, or over a part of a run; the cases are computed from the commands."""

import pickle
import shutil
from itertools import product

import click
import pytest
from click.testing import CliRunner
from policies import policy

from aero.policy.file import save
from hil.cli import main
from hil.cli.command_table import commands
from hil.cli.output_files import Output, OutputFile, OutputFolder
from hil.emulated.any_hand import open_target
from hil.report.results import write_results
from hil.report.run_folder import DATA
from hil.verdict.validation import validate

NOT_FILES = {"faults", "defines", "sanitize", "bus_port", "save", "hand", "names"}
"""Texts of a command line that name no file."""


def leaves(group, words=()):
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from leaves(command, (*words, name))
        else:
            yield (*words, name), command


COMMANDS = list(leaves(main))


def outputs(command):
    return [one for one in command.params if isinstance(one.type, Output)]


def inputs(command):
    """Return the parameters that name a file: by their type, or as text."""
    return [
        one
        for one in command.params
        if not isinstance(one.type, Output)
        and (isinstance(one.type, click.Path) or (one.type is click.STRING and one.name not in NOT_FILES))
    ]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Good files and folders: names of parameters, and what they read."""
    folder = tmp_path_factory.mktemp("read")
    run = folder / "run"
    run.mkdir()
    with open_target() as target:
        write_results(validate(target, ["presence"], folder=run), run)
    recording, weights, unit = folder / "a.mcap", folder / "a.npz", folder / "a.toml"
    shutil.copy(run / "presence.mcap", recording)
    save(policy(), weights)
    unit.write_text("[servos]\nstart_temperature_c = [30.0, 30.0, 30.0, 30.0, 30.0, 30.0, 30.0]\n")
    (folder / "a.pkl").write_bytes(pickle.dumps([{"params": [1.0] * 100}]))
    program = folder / "program"
    program.write_bytes(b"\x7fELF\x02\x01\x01" + bytes(200))
    program.chmod(0o755)
    (folder / "library").mkdir()
    return {
        "recording": recording, "recordings": recording, "runs": recording, "others": recording, "source": recording,
        "policy_name": weights, "parameters": weights, "checkpoint": folder / "a.pkl", "unit": unit, "start": unit,
        "correction_name": unit, "firmware_program": program, "first": program, "second": program, "port": program,
        "target_name": program, "baseline": run, "results": run, "folders": run, "folder": run,
        "library": folder / "library", "hand": "x",
    }  # fmt: skip


def line(words, command, given, made, tmp_path):
    """Return a command line with the parameters `given`, and good values of the others that it needs."""
    values = {one.name: [made[one.name]] for one in command.params if one.required and one.name in made}
    for one in outputs(command):
        if one.required:
            values[one.name] = [tmp_path / f"new-{one.name}"]
    values |= {name: [value] for name, value in given.items()}
    by_name = {one.name: one for one in command.params}
    options = [
        (by_name[name].opts[-1], value) for name, value in values.items() if isinstance(by_name[name], click.Option)
    ]
    arguments = [
        value for one in command.params if isinstance(one, click.Argument) for value in values.get(one.name, ())
    ]
    return [*words, *(str(word) for option, (value,) in options for word in (option, value)), *map(str, arguments)]


def snapshot(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


PAIRS = [
    pytest.param((words, command, read, written), id=f"{'-'.join(words)}:{read.name}-{written.name}")
    for words, command in COMMANDS
    for read, written in product(inputs(command), outputs(command))
]


def test_every_command_of_this_checkout_is_here():
    assert {words[0] for words, _ in COMMANDS} == set(commands())
    assert len(PAIRS) > 30


@pytest.mark.parametrize(("words", "command"), COMMANDS, ids=["-".join(words) for words, _ in COMMANDS])
def test_every_path_of_a_command_line_is_read_or_written(words, command):
    paths = [one for one in command.params if isinstance(one.type, click.Path)]
    assert [one.name for one in paths if isinstance(one.type, Output) == one.type.exists] == []


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("pair", PAIRS)
def test_a_command_writes_over_nothing_that_it_reads(pair, made, tmp_path):
    words, command, read, written = pair
    path = made[read.name]
    root = made["recording"].parent
    before = snapshot(root)
    ways = [path]
    if isinstance(written.type, OutputFile) and path.is_file():
        (tmp_path / "link").symlink_to(path)
        ways.append(tmp_path / "link")
    for way in ways:
        given = line(words, command, {read.name: path, written.name: way}, made, tmp_path)
        ended = CliRunner().invoke(main, given)
        assert ended.exit_code == 2, (given, ended.output)
        assert "Traceback" not in ended.output
        assert snapshot(root) == before
        if isinstance(read.type, click.Path) and path.is_dir() == isinstance(written.type, OutputFolder):
            assert "would be overwritten" in ended.output


@pytest.mark.parametrize(
    "writer",
    [
        pytest.param((words, command, written), id=f"{'-'.join(words)}:{written.name}")
        for words, command in COMMANDS
        for written in outputs(command)
        if isinstance(written.type, OutputFile)
    ],
)
def test_no_command_writes_over_a_part_of_a_run(writer, made, tmp_path):
    words, command, written = writer
    run = made["results"]
    before = snapshot(run)
    for name in {path.name for path in before} & DATA:
        given = line(words, command, {written.name: run / name}, made, tmp_path)
        ended = CliRunner().invoke(main, given)
        assert ended.exit_code == 2, (given, ended.output)
        assert snapshot(run) == before
