"""Every trial comes to its end once, also when workers die, on this machine and on a cluster."""

import contextlib
import multiprocessing
import os
import signal
from collections import Counter

import pytest

from train.campaign.trial import Trial, perform
from train.workers import cluster, conduct, worker_processes

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


@pytest.mark.slow
def test_a_cluster_gives_the_same_numbers(expected):
    distributed = pytest.importorskip("distributed")
    came = []
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as local:
        conduct(TRIALS, perform, lambda: cluster(local.scheduler_address), came.append)
    assert numbers(came) == expected


def test_a_scheduler_that_does_not_answer_is_named():
    with pytest.raises(ValueError, match="no Dask scheduler answers at nowhere"), cluster("nowhere"):
        pass


def test_what_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="no unit 'wooden'"):
        conduct([Trial("wooden")], perform, lambda: worker_processes(1), print)
