import logging

import pytest
from lerobot_robot_aero.opening import opened, spec_of

from lerobot_robot_aero import AeroHandRobotConfig


@pytest.mark.slow
def test_a_fault_that_had_no_effect_yet_is_a_warning(caplog):
    config = AeroHandRobotConfig(port="emulated", fault="encoder_slip:index=40.0@1000.0")
    with caplog.at_level(logging.WARNING), opened(config, guarded=False) as target:
        assert target.real_time
        assert [str(fault) for fault in target.wrong] == [config.fault]
    assert "encoder_slip:index" in caplog.text
    assert "never fired" in caplog.text


def test_a_hand_on_a_port_takes_no_faults():
    config = AeroHandRobotConfig(port="/dev/ttyACM0", fault="gear_jammed:index")
    with pytest.raises(ValueError, match="faults are put into an emulated hand"), opened(config, guarded=True):
        pass


@pytest.mark.parametrize(("option", "message"), [({"fault": "none_such"}, "none_such"), ({"unit": "nobody"}, "nobody")])
def test_what_is_unknown_is_named(option, message):
    with pytest.raises(ValueError, match=message), opened(AeroHandRobotConfig(port="emulated", **option), guarded=True):
        pass


def test_what_hands_toml_says_of_a_name_counts_over_the_defaults(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hands.toml").write_text('[bench]\nport = "/dev/ttyACM7"\nside = "left"\nfirmware = "0.1.5"\n')
    spec = spec_of(AeroHandRobotConfig(port="bench"))
    assert (spec.port, spec.side, spec.firmware) == ("/dev/ttyACM7", "left", "0.1.5")
    assert spec_of(AeroHandRobotConfig(port="bench", side="right")).side == "right"
