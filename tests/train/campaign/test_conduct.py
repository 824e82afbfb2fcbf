"""Every trial comes to its end once, also when workers die."""

import contextlib
import multiprocessing
import os
import signal
from collections import Counter

import pytest

from train.campaign.trial import Trial, perform
from train.workers import conduct, worker_processes

TRIALS = [Trial(f"plausible:{seed}", seed=seed, homed=False, experiments=("presence",)) for seed in range(4)]


def numbers(outcomes):
    return {outcome.trial.key: outcome.numbers for outcome in outcomes}


@pytest.fixture(scope="module")
def expected():
    return numbers(map(perform, TRIALS))


def test_a_worker_that_is_killed_loses_nothing(expected):
    came = []

    def on_outcome(outcome):
        came.append(outcome)
        if len(came) == 1:
            for child in multiprocessing.active_children():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(child.pid, signal.SIGKILL)

    conduct(TRIALS, perform, lambda: worker_processes(1), on_outcome)
    assert Counter(outcome.trial for outcome in came) == Counter(TRIALS)
    assert numbers(came) == expected


def test_what_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="unknown unit 'wooden'"):
        conduct([Trial("wooden")], perform, lambda: worker_processes(1), print)
