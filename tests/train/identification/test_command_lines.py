import io
import re
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console

from aero.channels import Channel
from hil.recordings.mcap_file import read_recording
from model.units import load_unit
from train.cli.calibrate import _print, calibrate_command
from train.cli.record import record_command
from train.identification import excitation
from train.identification.calibration import calibrate
from train.identification.unit_parameters import FREE


def test_record_then_calibrate(tmp_path, monkeypatch):
    monkeypatch.setitem(excitation.MOTIONS, "steps", lambda: np.repeat([0.0, 0.3, 0.0], [10, 20, 20]))
    out = tmp_path / "a.mcap"
    result = CliRunner().invoke(
        record_command, ["--excite", "steps", "--channel", "index", "--out", str(out)], catch_exceptions=False
    )
    assert result.exit_code == 0, result.output
    assert "window" in result.output
    assert read_recording(out)["command_codes"].values[:, Channel.INDEX].max() > 0

    def quick(*arguments, **options):
        free = tuple(number for number in FREE if number.name == "hand.spool_friction")
        return calibrate(*arguments, **options, free=free)

    monkeypatch.setattr("train.cli.calibrate.calibrate", quick)
    unit = tmp_path / "unit.toml"
    result = CliRunner().invoke(
        calibrate_command, [str(out), "--out", str(unit), "--workers", "1"], catch_exceptions=False
    )
    assert result.exit_code == 0, result.output
    assert "counts rms" in result.output
    assert load_unit(str(unit)).hand.spool_friction[Channel.INDEX] > 0
    assert "95 % interval" in result.output
    assert "fitted, 95 % interval of each: 0." in unit.read_text()


def test_dry_run_moves_nothing(tmp_path):
    out = tmp_path / "a.mcap"
    result = CliRunner().invoke(record_command, ["--dry-run", "--out", str(out)], catch_exceptions=False)
    assert result.exit_code == 0
    assert "°C" in result.output
    assert "Fingers and thumb will close by up to" in result.output
    assert "the safe reach of each window: index 85 %, middle 85 %" in " ".join(result.output.split())
    assert not re.search(r"Motion\(|<Channel|\[0\.|-0\.00? ", result.output)
    assert not out.exists()


def test_bad_usage(tmp_path):
    bad = tmp_path / "a.npz"
    np.savez(bad, t_cmd=np.zeros(1))
    result = CliRunner().invoke(calibrate_command, [str(bad), "--out", str(tmp_path / "u.toml")])
    assert result.exit_code == 2
    assert "lacks" in result.output
    assert CliRunner().invoke(record_command, ["--scale", "2"]).exit_code == 2


@pytest.mark.parametrize("held_out", [(), (np.ones((4, 7)),)])
def test_how_well_a_unit_predicts_is_printed_where_it_is_known(held_out):
    console = Console(file=io.StringIO(), width=200)
    result = SimpleNamespace(
        told={}, traces=(SimpleNamespace(name="a"), SimpleNamespace(name="b")), channel_rms=lambda: np.ones((2, 7)),
        found=SimpleNamespace(residuals=(np.ones((4, 7)),)), held_out=held_out, unit=load_unit("reference"),
        intervals={},
    )  # fmt: skip
    _print(console, result)
    assert ("predicted from the others" in console.file.getvalue()) is bool(held_out)
