"""An experiment in a folder of one's own, or of another package, is run, measured and judged as ours are."""

import json
import os
import subprocess
import sys

import pytest

CHECK = '''
"""Nod with the index finger."""

import numpy as np

from hil.checks.shared.experiment import OPENED, Sampler, one_closed

FURTHEST = (0.3, 0, 0, 0, 0, 0, 0)


def run(target, recorder, progress):
    recorder.begin({})
    sampler = Sampler(target, recorder, progress, 2.0)
    sampler.hold(one_closed(0, 0.3), 1.0, "down")
    sampler.hold(OPENED, 1.0, "up")


def measure(recording):
    return {"index": {"nodded": 100.0 * float(np.max(recording["codes"].values[:, 0])) / 65535}}
'''
DECLARED = """
title = "Nod of the index finger"
rank = 15
hand_s = 2
by_default = false

[[metric]]
name = "nodded"
evidence = "travel"
words = "depth of the nod"
unit = "% of the window"
at_least = {least}
source = "the nod itself"
on = ["index"]
"""


def written(folder, least):
    folder.mkdir(parents=True)
    (folder / "__init__.py").touch()
    (folder / "check.py").write_text(CHECK)
    (folder / "checks.toml").write_text(DECLARED.format(least=least))


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """Validation with an experiment of a folder, one of an installed package, and two that cannot be used."""
    place = tmp_path_factory.mktemp("others")
    written(place / "mine" / "nod", 20.0)
    written(place / "mine" / "presence", 20.0)
    written(place / "site" / "someone" / "shake", 90.0)
    facts = place / "site" / "someone-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: someone\nVersion: 1\n")
    (facts / "entry_points.txt").write_text("[aero_hil.experiments]\nshake = someone.shake\ngone = someone.gone\n")
    folders = os.pathsep.join(str(place / "mine" / name) for name in ("nod", "presence"))
    paths = os.pathsep.join([str(place / "site"), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = ("-m", "hil.cli", "validate", "--only", "nod", "--only", "shake", "--out", place / "run")
    ours = os.environ | {"AERO_HIL_EXPERIMENTS": folders, "PYTHONPATH": paths}
    runs = (command, (*command[:3], "--only", "gone"))
    done, unknown = (
        subprocess.run((sys.executable, *words), env=ours, capture_output=True, text=True, check=False, cwd=place)
        for words in runs
    )
    (checks,) = (place / "run").rglob("checks.json")
    return done, json.loads(checks.read_text(encoding="utf-8")), unknown


def test_they_are_judged_as_ours(ended):
    done, checks, _ = ended
    assert done.returncode == 1
    passed = {
        finding["experiment"]: finding["passed"] for finding in checks["findings"] if finding["check"] == "nodded"
    }
    assert passed == {"nod": True, "shake": False}
    assert "depth of the nod" in done.stdout


def test_what_is_left_out_is_named_where_it_is_asked_for(ended):
    _, _, unknown = ended
    assert unknown.returncode == 2
    assert "someone.gone is left out" in unknown.stderr
    assert "presence is left out: there is a check presence already" in unknown.stderr
