"""Tables of `evaluate`, `predict` and `score` on terminals of any width, and what `evaluate` leaves."""

import io
import json

import numpy as np
import pytest
from click.testing import CliRunner
from policies import policy
from rich.console import Console

from aero.policy.file import save
from hil.cli import main
from hil.cli.terminal import print_columns
from train.cli.evaluation_tables import FIGURES, print_figures, print_lost, print_strata
from train.cli.score import score_tables
from train.evaluation.mismatches import Lost
from train.evaluation.trial_set import trial_set
from train.identification.replay_score import CAUSES, Errors, ReplayScore

ROW = dict.fromkeys(FIGURES, 0.875) | {"rate_rad_s_low": 0.51, "rate_rad_s_high": 0.97, "survival_low": 0.81}
ROW |= {"survival_high": 0.93}
SETS = [trial_set(name, [True] * 30, [15.0] * 30, range(30)) for name in ("all", "mass, g, 110 to 140", "left hand")]
LOST = [Lost("dead time of the servos", 12, 1.0, 1.8601, -0.1234, (-0.2601, 0.0912))]
ERRORS = Errors(np.full(7, 12.3456), np.array([0.0, 0.4999, *[np.nan] * 5]), np.full(7, 10.04))
SCORE = ReplayScore(
    (("run_10_hardware01_u_trace_replay", ERRORS),), ERRORS, ERRORS, dict.fromkeys(CAUSES, (0.361, 1.0))
)
TABLES = {
    "score": (lambda console: [console.print(table) for table in score_tables(SCORE)]),
    "figures": (lambda console: print_figures(console, "hands", {"any cube on any hand": ROW, "lag 25 ms": ROW})),
    "strata": (lambda console: print_strata(console, SETS)),
    "lost": (lambda console: print_lost(console, LOST)),
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


@pytest.mark.slow
def test_evaluate_leaves_figures_and_pictures_for_each_place(tmp_path):
    save(policy(), tmp_path / "policy.npz")
    line = f"evaluate {tmp_path / 'policy.npz'} --on simulation --on hands --on mismatches --episodes 2 --units 2"
    arguments = [*line.split(), "--trials", "1", "--seconds", "0.5", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    results = json.loads((tmp_path / "out" / "evaluation.json").read_text())["results"]
    assert set(results) == {"simulation", "hands", "mismatches"}
    assert results["hands"]["any cube on any hand"]["episodes"] == 2.0
    pictures = {path.name for path in (tmp_path / "out").glob("*.png")}
    assert pictures == {"delay.png", "strata.png", "mismatches.png"}
