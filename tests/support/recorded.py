"""Short runs of experiments, returned as their recordings."""

from hil.checks.staircase.check import run_staircase
from hil.recordings.policy_run import record_policy
from hil.recordings.recorder import Recorder, silent
from simulator import RoutedHand
from train.identification.excitation import EXPERIMENT, play


def staircase_of(target, plan, path=None):
    recorder = Recorder(target, "staircase", path)
    run_staircase(target, recorder, RoutedHand(target.side), plan)
    return recorder.finish()


def excitation_of(target, plan, progress=silent):
    recorder = Recorder(target, EXPERIMENT)
    play(target, recorder, plan, progress=progress)
    return recorder.finish()


def policy_of(target, policy, settings, progress=silent):
    """Return a policy run and its recording."""
    recorder = Recorder(target, "policy")
    result = record_policy(target, recorder, policy, settings, progress=progress)
    return result, recorder.finish()
