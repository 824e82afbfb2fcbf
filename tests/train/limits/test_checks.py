"""Every bound judges a number that exists."""

from hil.checks import BOUNDS, JUDGED


def test_checks_are_on_numbers_that_an_experiment_measures():
    checked = {(bound.experiment, bound.metric, subject) for bound in BOUNDS for subject in bound.subjects}
    measured = {
        (experiment.name, metric.name, subject)
        for experiment in JUDGED.values()
        for metric in experiment.metrics
        for subject in metric.subjects
    }
    assert checked <= measured
