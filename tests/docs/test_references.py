"""Options and page names in texts for users refer to things that exist."""

import ast
import re

import click
from pages import ROOT

from hil.cli import main

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
OTHERS = re.compile(r"pytest|tox -e|docker|python -m (train|examples)\b|figures|aero-hil servos|train\.shipped")
"""Lines of the pages with options of other programs."""
FOREIGN = ("--policy", "--hil", "--aero-hil", "--markers", "--check")
"""Options of the pytest plugin, and of `python -m figures`."""


def options(command, context):
    """Return the long options of a click command and of its subcommands."""
    found = {option for param in command.params for option in (*param.opts, *param.secondary_opts)} | {"--help"}
    for name in command.list_commands(context) if isinstance(command, click.Group) else ():
        found |= options(command.get_command(context, name), context)
    return found


def test_each_option_in_a_page_exists():
    known = options(main, click.Context(main))
    unknown = [
        f"{path.name}: {option}"
        for path in PAGES
        for line in path.read_text(encoding="utf-8").splitlines()
        if not OTHERS.search(line)
        for option in OPTION.findall(line)
        if option not in known and not option.startswith(FOREIGN)
    ]
    assert not unknown


def texts(path):
    """Return the string constants of a module without docstrings; a decorated function's docstring is a help text."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    helps = {id(node.body[0]) for node in nodes if isinstance(node, ast.FunctionDef) and node.decorator_list}
    hidden = {id(node.value) for node in nodes if isinstance(node, ast.Expr) and id(node) not in helps}
    constants = (node for node in nodes if isinstance(node, ast.Constant) and id(node) not in hidden)
    return [node.value for node in constants if isinstance(node.value, str)]


SOURCES = [
    path
    for package in ("aero", "firmware_emulator", "hil", "model", "simulator", "train")
    for path in (ROOT / package).rglob("*.py")
]


def test_no_message_or_help_names_a_file_that_a_wheel_lacks():
    named = [
        f"{path.name}: {text[:60]!r}" for path in SOURCES for text in texts(path) if re.search(r"docs/\w+\.md", text)
    ]
    assert not named


TITLE = re.compile(r'"([A-Z][\w ]+)" in the\s+documentation|\(documentation: ([A-Z][\w ]+), ([A-Z][\w ]+)\)')


def test_each_page_that_a_message_names_is_a_page():
    read = [path.read_text(encoding="utf-8") for path in PAGES]
    titles = {heading for page in read for heading in re.findall(r"^#+ (.+)$", page, re.M)}
    titles |= set(re.findall(r"- ([^:\n]+):", (ROOT / "mkdocs.yml").read_text(encoding="utf-8")))
    messages = "\n".join(path.read_text(encoding="utf-8") for path in (*SOURCES, ROOT / "hil/data/steps.toml"))
    named = {title for found in TITLE.findall(messages) for title in found if title}
    assert named
    assert named <= titles
