"""Tables of `evaluate` on terminals of any width, and what it leaves."""

import io
import json

import pytest
from click.testing import CliRunner
from policies import policy
from rich.console import Console

from aero.policy.file import save
from hil.cli import main
from hil.dialogue.terminal import print_columns
from train.cli.evaluate import FIGURES, print_figures

ROW = dict.fromkeys(FIGURES, 0.875) | {"rate_rad_s_low": 0.51, "rate_rad_s_high": 0.97, "survival_low": 0.81}
ROW |= {"survival_high": 0.93}
TABLES = {
    "figures": (lambda console: print_figures(console, "hands", {"any cube on any hand": ROW, "lag 25 ms": ROW})),
    "long name": (lambda console: print_columns(console, "", ["rad/s"], {"name " * 30: ["0.123 to 0.456"]})),
}


def printed(table, width):
    console = Console(width=width, file=io.StringIO())
    TABLES[table](console)
    return console.file.getvalue()


def words(text):
    return sorted(word for word in text.replace("│", " ").replace("┃", " ").split() if any(c.isalnum() for c in word))


@pytest.mark.parametrize("width", [60, 80])
@pytest.mark.parametrize("table", TABLES)
def test_a_narrow_table_has_more_parts_and_every_number_whole(table, width):
    narrow = printed(table, width)
    assert max(map(len, narrow.splitlines())) <= width
    assert "…" not in narrow
    assert set(words(printed(table, 400))) - set(words(narrow)) == set()


def evaluated(folder, line):
    """Return what `evaluate` of a small policy leaves and prints."""
    save(policy(), folder / "policy.npz")
    arguments = [str(folder / "policy.npz"), *line.split(), "--seconds", "0.5", "--out", str(folder / "out")]
    result = CliRunner().invoke(main, ["evaluate", *arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return json.loads((folder / "out" / "evaluation.json").read_text()), result.output


@pytest.mark.slow
def test_evaluate_leaves_figures(tmp_path):
    report, _ = evaluated(tmp_path, "--episodes 2 --units 2")
    assert set(report["results"]) == {"simulation", "hands"}
    assert report["results"]["hands"]["any cube on any hand"]["episodes"] == 2.0


def test_a_deployment_is_run_and_printed_beside_what_a_hand_did(tmp_path):
    report, said = evaluated(tmp_path, "--as ros2-node --episodes 2 --units 1 --cube 60 117 0.4")
    assert set(report["results"]["hands"]) == {"ros2-node"}
    assert len(report["results"]["simulation"]) == 2
    assert report["deployment"]["firmware"] == "pre"
    assert report["cube"]["side_m"] == 0.06
    assert "a physical hand turned the cube by 0.114 rad/s" in said


@pytest.mark.parametrize("line", ["--as ros2-node --correction none", "--cube 60 117 0.4"])
def test_options_of_the_other_way_to_evaluate_are_refused(line):
    result = CliRunner().invoke(main, ["evaluate", *line.split()])
    assert result.exit_code == 2
    assert "--as" in result.output
