"""What a stranger types first works, or says what to do."""

import subprocess
import sys

import pytest

import hil
from aero import open_hand


def test_the_flagship_is_called_from_python():
    with hil.emulate(faults=["motor_dead:ring"]) as target:
        assert hil.validate(target, ["presence"]).passed
        assert (target.name, [str(fault) for fault in target.wrong]) == ("emulated", ["motor_dead:ring=1.0"])
        assert target.truth.plant.joint_angles().shape == (16,)
        with pytest.raises(AttributeError, match=r"`target\.truth`"):
            target.get("GroundTruth")


@pytest.mark.parametrize(
    ("line", "kind", "answer"),
    [
        (lambda: hil.open_target("emulated"), AttributeError, r"hil\.emulate\(\.\.\.\) or hil\.open_port"),
        (lambda: hil.emulate(firmwre="0.2.0"), TypeError, "did you mean `firmware`.*unit, side"),
        (lambda: hil.open_port("/dev/ttyACM0", thresold=3), TypeError, "did you mean `thresholds`"),
        (
            lambda: hil.emulate(faults="motor_dead:ring"),
            ValueError,
            r"faults are a list, such as \['motor_dead:ring'\]",
        ),
        (lambda: hil.emulate(faults=["motor_ded:ring"]), ValueError, "did you mean `motor_dead`"),
        (lambda: hil.emulate(side="Left"), ValueError, "side is right or left"),
        (lambda: open_hand("/dev/ttyACM0", side="Left").__enter__(), ValueError, "side must be one of"),
        (lambda: hil.open_port("emulated"), ValueError, r"hil\.emulate\(\)"),
    ],
)
def test_a_wrong_line_says_what_to_do(line, kind, answer):
    with pytest.raises(kind, match=answer):
        line()


def test_the_public_names_exist_and_are_all_that_is_listed():
    assert dir(hil) == sorted(hil.__all__)
    assert all(getattr(hil, name).__doc__ for name in hil.__all__)


def test_a_hand_of_another_kind_has_no_faults_and_says_so(monkeypatch):
    with hil.emulate() as target:
        other = hil.Target(**{name: getattr(target, name) for name in hil.Target.__dataclass_fields__})
        with pytest.raises(hil.MissingCapabilityError, match="has no `inject`; run with --hil=emulated"):
            other.inject("motor_dead:ring")


PROGRAM = """
import hil
print([name for name in hil.CATALOGUE if name.startswith("my_")], hil.parse_fault("my_rub:ring"))
"""


def test_faults_of_another_package_are_found_and_broken_ones_left_out(tmp_path):
    facts = tmp_path / "mine-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1\n")
    (facts / "entry_points.txt").write_text(
        "[aero_hil.faults]\nmine = mine:FAULTS\ngone = gone:FAULTS\nbad = mine:BAD\n"
    )
    (tmp_path / "mine.py").write_text(
        "from dataclasses import replace\n"
        "from hil.emulated.faults.mechanics import FAULTS as OURS\n"
        "FAULTS = (replace(OURS[0], name='my_rub'), OURS[1])\nBAD = 5\n"
    )
    command = [sys.executable, "-c", PROGRAM]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, env={"PYTHONPATH": str(tmp_path)})
    assert ran.stdout.startswith("['my_rub'] my_rub:ring=")
    assert sum("is left out" in line for line in ran.stderr.splitlines()) == 3
