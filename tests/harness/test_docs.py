"""The documents name checks, commands and files that exist."""

import re
from pathlib import Path

import click
import pytest

from hil.checks import EXPERIMENTS
from hil.cli import COMMANDS, main
from hil.cli.exits import Exit
from hil.verdict.limits import load_limits

ROOT = Path(__file__).parents[2]
MEASURED = {"staircase": {"rise_model_ms"}, "excursion": {"stop_current", "fist_travel"}}
"""Measured without a limit."""


@pytest.mark.parametrize("name", ["owner_problems.md", "validation.md"])
def test_every_check_that_is_named_exists(name):
    text = (ROOT / "docs" / name).read_text()
    limits = {(limit.experiment, limit.metric) for firmware in ("pre", "0.2.0") for limit in _limits(firmware)}
    named = re.findall(rf"`({'|'.join(EXPERIMENTS)})\.(?!mcap)(\w+)`", text)
    assert len(named) > 8
    for experiment, metric in named:
        assert (experiment, metric) in limits or metric in MEASURED.get(experiment, ()), f"{experiment}.{metric}"


def test_all_29_problems_have_an_answer():
    rows = re.findall(r"^\| (\d+) \| (.+?) \| (.+?) \|$", (ROOT / "docs" / "owner_problems.md").read_text(), re.M)
    assert [int(number) for number, _, _ in rows] == list(range(1, 30))
    assert all(len(answer) > 20 for _, _, answer in rows)


@pytest.mark.parametrize("name", ["validation.md", "owner_problems.md"])
def test_every_command_that_is_named_exists(name):
    for command in re.findall(r"`aero-hil (\w[\w-]*)", (ROOT / "docs" / name).read_text()):
        assert command in COMMANDS


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))], ids=lambda path: path.name
)
def test_every_file_that_is_named_exists(page):
    for name in re.findall(r"`((?:\w+/)+\w+\.(?:py|toml|npz|csv|png))`", page.read_text()):
        assert (ROOT / name).exists(), name


@pytest.mark.parametrize("code", Exit)
def test_every_exit_code_is_in_the_table(code):
    assert f"| {code.value} |" in (ROOT / "docs" / "commands.md").read_text()


def _limits(firmware):
    return load_limits("aero_hand_open", firmware)


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SHOWN_COMMANDS = sorted(
    {
        (page.name, part.partition("#")[0].strip())
        for page in PAGES
        for block in re.findall(r"^```(?:sh)?\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M)
        for line in block.splitlines()
        for part in re.split(r"&&|;", line)
        if part.strip().startswith("aero-hil ")
    }
)


@pytest.mark.parametrize(("page", "line"), SHOWN_COMMANDS)
def test_every_command_that_is_shown_has_these_options(page, line):
    _, name, *words = line.split()
    command = main.get_command(click.Context(main), name)
    assert command is not None, f"{page}: there is no {name}"
    if isinstance(command, click.Group):
        command = command.get_command(click.Context(command), words[0])
        assert command is not None, f"{page}: {line}"
    known = {option for parameter in command.params for option in parameter.opts + parameter.secondary_opts}
    asked = {word.partition("=")[0] for word in words if word.startswith("--")}
    assert asked <= known | {"--help"}, f"{page}: {line}"


def test_every_link_of_the_readme_leads_to_a_file():
    named = re.findall(r"\]\(([^)#:]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(named) > 15
    assert [name for name in named if not (ROOT / name).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_lines_outside_tables_and_blocks_fit_into_120_columns(page):
    """What is generated, between the markers of cog, is as long as it comes."""
    prose = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    prose = re.sub(r"^<!-- \[\[\[cog.*?^<!-- \[\[\[end\]\]\] -->", "", prose, flags=re.M | re.S)
    assert [line for line in prose.splitlines() if len(line) > 120 and not line.startswith("|")] == []
