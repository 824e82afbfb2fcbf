"""Signals that stop a program interrupt what waits or moves; what follows runs to its end, and they are not lost."""

import signal
from contextlib import contextmanager, suppress

import pytest

from aero.safety.interrupts import let_through_at_entry, stops_held, stops_let_through, uninterrupted, unwinding


def ctrl_c():
    signal.raise_signal(signal.SIGINT)


@contextmanager
def interrupted():
    with pytest.raises(KeyboardInterrupt):
        yield


def test_a_signal_between_motions_ends_the_run_at_the_next_one():
    done = []
    with interrupted(), stops_held():
        ctrl_c()
        done.append("finished")
        with stops_let_through():
            done.append("moved")
    assert done == ["finished"]


def test_a_signal_after_the_last_motion_is_delivered_at_the_end():
    done = []
    with interrupted(), stops_held():
        with stops_let_through():
            done.append("moved")
        ctrl_c()
        done.append("written")
    assert done == ["moved", "written"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_signal_is_let_through_and_a_second_one_loses_nothing(number):
    done = []
    with stops_held(), unwinding():
        try:
            with stops_let_through():
                signal.raise_signal(number)
                done.append("moved")
        except (KeyboardInterrupt, SystemExit):
            ctrl_c()
            done.append("finished")
        with stops_let_through():
            ctrl_c()
        done.append("written")
    assert done == ["finished", "written"]
    with pytest.raises(KeyboardInterrupt):
        ctrl_c()


def test_nested_blocks_deliver_once_at_the_end_of_the_outermost():
    done = []
    with interrupted(), stops_held():
        with stops_held():
            ctrl_c()
            ctrl_c()
        done.append("inner")
        with uninterrupted():
            done.append("guarded")
    assert done == ["inner", "guarded"]


def test_a_signal_that_is_ignored_leaves_room_for_another():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with interrupted(), stops_held(), stops_let_through():
            signal.raise_signal(signal.SIGHUP)
            ctrl_c()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_an_entry_is_interrupted_and_its_exit_is_not():
    done = []

    @contextmanager
    def opening(*, interrupted):
        if interrupted:
            ctrl_c()
        yield done.append("opened")
        ctrl_c()
        done.append("closed")

    for interrupted in (True, False):
        with suppress(KeyboardInterrupt), stops_held(), let_through_at_entry(opening(interrupted=interrupted)):
            done.append("moved")
    assert done == ["opened", "moved", "closed"]
