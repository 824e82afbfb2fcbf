import threading

import pytest
from lerobot_robot_aero.idle_watch import IDLE_S, IdleWatch

from aero.errors import LinkTimeoutError
from aero.safety import SafetyStopError

PATIENCE_S = 10.0


class Hand:
    """Counts looks, and answers each as it is told; the last answer stays."""

    name = "hand"

    def __init__(self, *answers, age_s=1.0):
        self.reading_age_s = age_s
        self.answers = list(answers) or [None]
        self.looks = 0
        self.looked = threading.Semaphore(0)

    def read_codes(self):
        self.looks += 1
        self.looked.release()
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if answer is not None:
            raise answer

    def wait_for(self, looks):
        return all(self.looked.acquire(timeout=PATIENCE_S) for _ in range(looks))


def test_an_idle_hand_is_looked_at_again_and_again_until_the_end():
    hand = Hand()
    with IdleWatch(hand, threading.Lock()) as watch:
        assert hand.wait_for(3)
    assert not watch._thread.is_alive()


def test_a_lost_reading_does_not_end_it():
    hand = Hand(LinkTimeoutError("late"), None)
    with IdleWatch(hand, threading.Lock()):
        assert hand.wait_for(2)


@pytest.mark.parametrize("error", [SafetyStopError("stopped"), ConnectionError("unplugged")])
def test_a_stopped_hand_ends_it(error):
    hand = Hand(error)
    with IdleWatch(hand, threading.Lock()) as watch:
        watch._thread.join(PATIENCE_S)
        assert not watch._thread.is_alive()
    assert hand.looks == 1


def test_a_hand_in_use_is_left_alone():
    hand = Hand(age_s=IDLE_S / 2)
    with IdleWatch(hand, threading.Lock()) as watch:
        watch._thread.join(5 * IDLE_S)
    assert hand.looks == 0


def test_the_lock_covers_every_look():
    hand, lock = Hand(), threading.Lock()
    with IdleWatch(hand, lock) as watch:
        with lock:
            hand.looked = threading.Semaphore(0)
            watch._thread.join(5 * IDLE_S)
            assert not hand.looked.acquire(blocking=False)
        assert hand.wait_for(1)
