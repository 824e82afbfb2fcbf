"""Types of the five packages in somebody's own project, by mypy in an environment of its own."""

import subprocess

import pytest

pytestmark = pytest.mark.slow
OWN_TEST = """
import firmware_emulator, model, train
import hil

def test_reads(aero_target: hil.Target) -> None:
    reveal_type(aero_target.hand)
"""


def test_the_hand_of_a_test_is_typed(tmp_path, installed):
    (tmp_path / "test_own.py").write_text(OWN_TEST, encoding="utf-8")
    command = [installed("'.[suite]' mypy") / "mypy", "--strict", "test_own.py"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert 'Revealed type is "aero.driver.AeroHand | aero.safety.guarded.GuardedHand"' in ran.stdout
