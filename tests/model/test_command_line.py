"""`python -m model`: what it writes can be used."""

from __future__ import annotations

import mujoco
import pytest

from model.__main__ import BUILDERS, main

ACTUATORS = {"routed": 7, "built": 14}
"""A built hand's motors have a second one each, for their back-EMF."""


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("kind", BUILDERS)
def test_export_writes_a_model_that_loads(tmp_path, capsys, side, kind):
    path = tmp_path / "hand.xml"
    main(["export", "--hand", side, "--kind", kind, "--out", str(path)])
    assert mujoco.MjModel.from_xml_path(str(path)).nu == ACTUATORS[kind]
    assert str(path) in capsys.readouterr().out


def test_unknown_hand_is_bad_usage(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["export", "--hand", "third", "--out", str(tmp_path / "x.xml")])
    assert "right" in capsys.readouterr().err
