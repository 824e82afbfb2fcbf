"""What a campaign says about its checks, on outcomes whose answer is known."""

import io
from dataclasses import replace
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from outcomes import outcome
from rich.console import Console

from hil.emulated.faults import parse_fault
from hil.verdict.limits import Limit
from train.campaign.summary import Share, detections, false_alarms, flagged, render_campaign, right_part, told
from train.campaign.trial import Trial, faulty_hands, healthy_hands
from train.cli.campaign import campaign, run_trials

TRACKING = Limit("staircase", "tracking_rms", ("index", "middle", "ring", "pinky"), at_most=1.0, healthy=(-0.5, 0.5))


@pytest.fixture(autouse=True)
def one_limit(monkeypatch):
    for judging in ("train.campaign.summary", "hil.verdict.judge"):
        monkeypatch.setattr(f"{judging}.load_limits", lambda firmware, guarded: (TRACKING,))


def faulty(tracking, fault="cable_snapped:index=1.0", on="index", **more):
    table = outcome(Trial("reference")).numbers
    table["staircase"][on]["tracking_rms"] = tracking
    return outcome(Trial("reference", faults=(fault,)), numbers=table, **more)


def test_who_is_flagged():
    assert not flagged(faulty(0.9))
    assert flagged(faulty(1.1))
    assert flagged(faulty(0.9, stopped="the hand does not answer"))


def test_false_alarms_are_counted_by_hand_and_by_check():
    good = outcome(Trial("reference"))
    bad = replace(faulty(1.1), trial=Trial("reference", seed=1))
    share, by_check = false_alarms([good, bad, faulty(1.1)])
    assert (share.count, share.of) == (1, 2)
    assert by_check == {"staircase/tracking_rms/index": 1}


def test_the_interval_of_none_in_two_hundred():
    low, high = Share(0, 200).interval
    assert low == 0.0
    assert high == pytest.approx(0.0188, abs=2e-4)


def test_a_fault_is_found_where_a_check_fails_and_what_is_said_of_it_is_compared():
    (row,) = detections([faulty(4.0), faulty(0.2)])
    assert (row.name, row.found.count, row.found.of) == ("cable_snapped", 1, 2)
    assert row.checks == (("staircase/tracking_rms", 1),)
    assert row.located == 1
    (row,) = detections([faulty(4.0, on="ring")])
    assert row.located == 0


def test_where_and_why_are_judged_by_the_present_rules():
    """A stored campaign is judged anew, whatever was said of its hands when they ran."""
    assert set(told(faulty(4.0, suspects=("DIGIT/ring",)))) == {"SERVO/index", "DIGIT/index", "SETUP"}


def test_a_run_that_an_error_ended_keeps_what_was_said_of_it():
    ended = faulty(0.2, stopped="it stopped", ended="SafetyStopError", suspects=("DIGIT/index",))
    (row,) = detections([ended])
    assert row.located == 1


def test_the_part_at_fault_is_right_and_so_is_a_channels_servo_for_its_digit():
    assert right_part(parse_fault("supply_low"), ("SUPPLY", "USB"))
    assert not right_part(parse_fault("supply_low"), ("USB",))
    assert right_part(parse_fault("cable_snapped:index"), ("SERVO/index",))
    assert not right_part(parse_fault("cable_snapped:index"), ("SERVO/ring", "SUPPLY"))


def test_a_fault_counts_as_found_from_where_every_hand_is_flagged():
    mild, medium, severe = (f"encoder_scale:index={scale}" for scale in (1.02, 1.05, 1.2))
    runs = [faulty(4.0, mild), faulty(4.0, medium), faulty(0.9, medium), faulty(4.0, severe), faulty(4.0, severe)]
    rows = detections(runs)
    assert [row.found.count for row in rows] == [1, 1, 2]


def test_a_fault_that_never_fired_counts_for_nothing():
    never = faulty(4.0, ended="FaultNeverFiredError", stopped="never fired")
    assert detections([never]) == ()


def test_the_page_names_what_it_found():
    page = render_campaign([outcome(Trial("reference")), faulty(4.0), faulty(0.2)])
    assert "cable snapped" in page
    assert "1 of 2" in page
    assert "http" not in page


def test_plans_take_sides_and_firmware_in_turn():
    hands = healthy_hands(7, 8)
    assert {(trial.side, trial.firmware, trial.guarded) for trial in hands} == {
        (side, version, guarded)
        for side in ("right", "left")
        for version in ("0.2.0", "0.1.5")
        for guarded in (False, True)
    }
    assert len({trial.unit for trial in hands}) == 8
    assert all(trial.homed and not trial.faults for trial in hands)
    dead, other = "motor_dead:ring=1.0", "board_runs_0.2.0=1.0"
    faulty = faulty_hands([dead, other], 0, 2)
    assert [trial.faults for trial in faulty] == [(dead,), (dead,), (other,), (other,)]
    assert not any(trial.guarded for trial in faulty)
    assert {trial.firmware for trial in faulty[2:]} == {"0.1.5"}
    both = faulty_hands([f"{dead},{other}"], 0, 2)
    assert [(trial.faults, trial.firmware) for trial in both] == [((dead, other), "0.1.5")] * 2


def test_faults_that_cannot_share_a_hand_are_refused_before_anything_runs(tmp_path):
    both = "motor_dead:ring,motor_dead:ring=1"
    result = CliRunner().invoke(campaign, ["--fault", both, "--out", str(tmp_path / "campaign")])
    assert result.exit_code == 2
    assert "cannot be combined" in result.output
    assert not (tmp_path / "campaign").exists()


@pytest.mark.parametrize("left", [1, 2])
def test_a_campaign_that_is_broken_off_says_how_many_are_left(tmp_path, monkeypatch, left):
    def broken(trials, _perform, _workers, _keep):
        raise KeyboardInterrupt

    monkeypatch.setattr("train.cli.campaign.conduct", broken)
    console = Console(file=io.StringIO(), width=200)
    store = SimpleNamespace(require_commit=lambda _commit: None, keys=frozenset)
    with pytest.raises(KeyboardInterrupt):
        run_trials(console, [Trial("reference", seed=seed) for seed in range(left)], store, None, tmp_path)
    assert f"{left} of {left} runs are left" in console.file.getvalue()
