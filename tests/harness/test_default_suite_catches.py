"""What `pytest tests/hil` runs on a port by default is enough to find a hand that is not as it should be."""

import tomllib
from importlib import resources

import pytest

from firmware_emulator.servo.parameters import HLS3606M
from hil.faults import parse_fault
from hil.targets.opening import open_target
from hil.verdict.findings import failed
from hil.verdict.validation import validate
from tests.hil.test_experiments import QUICK

DEFAULT_FIRMWARE = "0.2.0"
ENDED = "the run ended before its time"
STAIRCASE = ("short_staircase",)
"""Finds what is slow and what is wound backwards; the others take twice its time."""


def found(unit="reference", firmware=DEFAULT_FIRMWARE, *faults, experiments=QUICK):
    """Return what fails on a guarded hand, as every hand on a port is, as `experiment/metric/subject`, or `ENDED`."""
    with open_target(unit=str(unit), firmware=firmware, guarded=True, faults=map(parse_fault, faults)) as target:
        done = validate(target, experiments)
    ended = done.end.finding
    return {
        f"{name}/{finding.check}/{finding.subject}"
        for name, result in done.results.items()
        for finding in failed(result.findings)
    } | ({ENDED} if ended else set())


@pytest.fixture
def changed(tmp_path):
    """Write the reference unit with one constant of its servos changed by a factor; returns the file."""

    def write(name, factor):
        text = (resources.files("model.units") / "reference.toml").read_text(encoding="utf-8")
        servos = tomllib.loads(text)["servos"]
        value = factor * servos.get(name, getattr(HLS3606M, name))
        lines = [line for line in text.splitlines() if not line.startswith(f"{name} =")]
        lines.insert(lines.index("[servos]") + 1, f"{name} = {value}")
        path = tmp_path / f"{name}.toml"
        path.write_text("\n".join(lines), encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("firmware", ["pre", DEFAULT_FIRMWARE])
def test_a_healthy_hand_passes(firmware):
    assert found(firmware=firmware) == set()


def test_the_one_that_finds_most_is_among_them():
    assert set(STAIRCASE) <= set(QUICK)


def test_a_servo_with_a_third_of_its_speed_gone_is_slow():
    failing = found("reference", DEFAULT_FIRMWARE, "slow_servo:index=0.3", experiments=STAIRCASE)
    assert "short_staircase/rise_percent/index" in failing


@pytest.mark.parametrize(
    ("channel", "by", "experiments"),
    [
        ("index", "short_staircase/tracking_rms/index", STAIRCASE),
        ("thumb_cmc_flexion", ENDED, QUICK),  # the guard stops a thumb that is driven into its stop
        ("thumb_flexor", "short_staircase/tracking_rms/thumb_flexor", STAIRCASE),
    ],
)
def test_a_cable_wound_backwards_is_found(channel, by, experiments):
    assert by in found("reference", DEFAULT_FIRMWARE, f"winding_reversed:{channel}", experiments=experiments)


def test_a_position_gain_of_four_fifths_is_slow_on_every_channel(changed):
    failing = found(changed("duty_per_count", 0.8), experiments=STAIRCASE)
    slow = {check for check in failing if "rise_hand_ms" in check}
    assert len(slow) >= 6


def test_an_acceleration_of_seven_tenths_is_slow_where_the_firmware_has_a_profile(changed):
    """With acceleration 0, which firmware after `pre` sends, a servo accelerates as its motor can."""
    failing = found(changed("acceleration_unit_counts", 0.7), "pre", experiments=STAIRCASE)
    slow = {check for check in failing if "rise_hand_ms" in check}
    assert len(slow) >= 4
