"""Every check judges a number that exists."""

from hil.checks import CHECKS, JUDGED


def test_checks_are_on_numbers_that_an_experiment_measures():
    checked = {(check.experiment, check.metric, subject) for check in CHECKS for subject in check.subjects}
    measured = {
        (experiment.name, metric.name, subject)
        for experiment in JUDGED.values()
        for metric in experiment.metrics
        for subject in metric.subjects
    }
    assert checked <= measured
