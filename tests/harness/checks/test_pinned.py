"""Every number that is measured is asserted on a recording made by hand."""

import ast
from pathlib import Path

import pytest

from hil.checks import JUDGED

OPENS_A_HAND = "open_target"


def module_of(measuring):
    """`audit` of `hil.checks.audit.check`."""
    return measuring.measure.__module__.split(".")[2]


def asserted():
    """Module to the names that tests of it compare: strings and attributes in assertions and in tables of values."""
    found = {}
    for path in Path(__file__).parent.glob("test_*.py"):
        text = path.read_text(encoding="utf-8")
        if OPENS_A_HAND in text or path == Path(__file__):
            continue
        tree = ast.parse(text)
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        full = [f"{node.module}.{alias.name}".split(".") for node in imports for alias in node.names]
        modules = {parts[2] for parts in full if parts[:2] == ["hil", "checks"]}
        compared = [node for node in ast.walk(tree) if isinstance(node, (ast.Assert, ast.Dict))]
        inner = [node for outer in compared for node in ast.walk(outer)]
        names = {node.value for node in inner if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        names |= {node.attr for node in inner if isinstance(node, ast.Attribute)}
        for module in modules:
            found.setdefault(module, set()).update(names)
    return found


@pytest.mark.parametrize("name", JUDGED)
def test_every_metric_is_pinned(name):
    metrics = {metric.name for metric in JUDGED[name].metrics}
    assert metrics - asserted().get(module_of(JUDGED[name]), set()) == set()
