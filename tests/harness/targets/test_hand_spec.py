"""One hand, whoever says it: from options, `hands.toml` and Python, and to a command line and back."""

from dataclasses import replace

import click
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from aero.firmware import FIRMWARE
from aero.safety import Thresholds
from hil.cli.options import target
from hil.emulated.any_hand import open_target
from hil.emulated.emulated_spec import EmulatedSpec, named_spec
from hil.emulated.faults import parse_fault
from hil.emulated.served_hand import spec_of, spec_text
from hil.targets.hand_spec import PortSpec
from model.units.conditions import Conditions
from simulator.scene import Cube

FAULTS = ("motor_weak:ring=0.4", "encoder_offset:index=100@5", "motor_dead:pinky", "link_silent@3")
SPECS = st.builds(
    EmulatedSpec,
    port=st.sampled_from(["emulated", "pty"]),
    firmware=st.sampled_from(list(FIRMWARE)),
    side=st.sampled_from(["right", "left"]),
    unit=st.sampled_from(["reference", "plausible:7", "a folder/mine.toml", "unfinished:x.toml", "--odd.toml"]),
    seed=st.integers(0, 2**32 - 1),
    hand_id=st.sampled_from(["", "bench-left", "a b"]),
    homed=st.booleans(),
    faults=st.lists(st.sampled_from(FAULTS), max_size=2, unique=True).map(lambda texts: tuple(map(parse_fault, texts))),
)


def read_back(argv, of_a_hand):
    """Return the hand that a command with the options of a hand gets."""

    @click.command()
    @of_a_hand
    def command(*, spec):
        return spec

    done = CliRunner().invoke(command, argv, standalone_mode=False)
    assert done.exception is None, done.exception
    return done.return_value


@given(spec=SPECS)
def test_the_process_that_serves_a_hand_gets_the_same_one(spec):
    assert spec_of(spec_text(spec)) == replace(spec, port="pty", hand_id="")


def test_hands_toml_options_and_python_say_the_same_hand(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hands.toml").write_text('[bench]\nport = "pty"\nfirmware = "0.1.5"\nside = "left"\ntwin = "ideal"\n')
    expected = EmulatedSpec("pty", "0.1.5", "left", hand_id="bench", twin="ideal")
    assert named_spec("bench") == expected
    assert read_back(["--hil", "bench"], target) == expected
    assert named_spec("bench", side="right") == replace(expected, side="right")
    assert read_back(["--hil", "bench", "--side", "right"], target) == replace(expected, side="right")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"firmware": "9.9"}, "unknown firmware '9.9'"),
        ({"side": "both"}, "right or left, not 'both'"),
        ({"firmwre": "0.1.5"}, "did you mean `firmware`"),
        ({"faults": "motor_dead:ring"}, r"faults are a list, such as \['motor_dead:ring'\]"),
        ({"name": "/dev/x", "firmware_program": "p"}, "a firmware program runs on an emulated hand"),
        ({"name": "/dev/x", "faults": (parse_fault("motor_dead:ring"),)}, "see `aero-hil proxy`"),
        ({"name": "pty", "cube": Cube()}, "in this process"),
        ({"name": "pty", "conditions": Conditions()}, "in this process"),
    ],
)
def test_what_cannot_be_is_refused_once(fields, message):
    with pytest.raises(ValueError, match=message):
        named_spec(**fields)


def test_a_physical_hand_is_guarded_unless_it_must_not_be():
    assert EmulatedSpec().guard is None
    assert PortSpec("/dev/x").guard == Thresholds()
    assert PortSpec("/dev/x", guarded=False).guard is None
    assert EmulatedSpec(guarded=True, thresholds=Thresholds(current_a=1.0)).guard == Thresholds(current_a=1.0)


def test_a_hand_is_opened_by_its_spec_and_in_short():
    spec = EmulatedSpec(firmware="0.1.5", side="left", seed=3)
    with open_target(spec) as target_, open_target("emulated", firmware="0.1.5", side="left", seed=3) as short:
        assert target_.describe() == short.describe() == "left hand on emulated, firmware 0.1.5, unit reference, seed 3"
