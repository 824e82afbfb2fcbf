"""CALIBRATE_MID behind the guard: slow and weak meanwhile, its usual limits afterwards, whatever came before."""

import logging
import struct

import numpy as np
import pytest
from guarded_hands import close, guarded, torque_limits, wait

from aero import Channel
from aero.channels import WIRE_ORDER
from aero.errors import LinkTimeoutError
from aero.protocol import Opcode
from aero.safety import Thresholds

GENTLE = Thresholds().gentle_speed, Thresholds().gentle_torque
CHANNEL = Channel.MIDDLE


def sent(target):
    """Opcode and words of every frame that went to the hand."""
    frames = [record.data for record in target.wire.since(0, 0.0) if record.direction == "to_hand"]
    return [(frame[0], struct.unpack("<7H", frame[2:])) for frame in frames]


def settings(frames):
    """Speed and torque that the board has for the channel after these frames."""
    number = WIRE_ORDER.index(CHANNEL)
    return tuple(
        next(words[1] for code, words in reversed(frames) if code == opcode and words[0] == number)
        for opcode in (Opcode.SET_SPE, Opcode.SET_TOR)
    )


@pytest.mark.parametrize("torque_mode", [False, True])
def test_it_calibrates_weak_and_slow_in_position_mode_and_gives_the_limits_back(torque_mode, caplog):
    with guarded(firmware="main") as target:
        close(target, CHANNEL, share=0.5)
        wait(target, 1.5)
        if torque_mode:
            target.hand.command_torques([100] * 7)
            wait(target, 0.05)
        usual = settings(sent(target))
        before = target.hand.read_codes()
        with caplog.at_level(logging.WARNING):
            centred = target.hand.calibrate_mid(CHANNEL)
        frames = sent(target)
        wait(target, 0.5)
        after = target.hand.read_codes()
        at = next(index for index, (code, _) in enumerate(frames) if code == Opcode.CALIBRATE_MID)
        assert settings(frames[:at]) == GENTLE
        modes = [code for code, _ in frames[:at] if code in {Opcode.CTRL_POS, Opcode.CTRL_TOR}]
        assert modes[-1] == Opcode.CTRL_POS
        assert settings(frames) == usual != GENTLE
        target.hand.command_codes(after)
        wait(target, 0.1)
        assert torque_limits(target)[WIRE_ORDER.index(CHANNEL)] == usual[1]
    assert centred.near_middle
    # 2048 counts in the window of a right hand's finger, 3278 to 0: it stands where it stood, and reads elsewhere.
    assert after[CHANNEL] == pytest.approx((3278 - 2048) * 65535 / 3278, abs=1000)
    others = [channel for channel in Channel if channel is not CHANNEL]
    assert np.abs(after[others].astype(int) - before[others]).max() < 2500
    assert "the finger may jump" in caplog.text


def test_the_limits_come_back_when_the_board_does_not_know_it():
    with guarded(firmware="0.2.0") as target:
        close(target, CHANNEL, share=0.3)
        wait(target, 1.0)
        usual = settings(sent(target))
        with pytest.raises(LinkTimeoutError, match="too old for CALIBRATE_MID"):
            target.hand.calibrate_mid(CHANNEL)
        assert settings(sent(target)) == usual != GENTLE
