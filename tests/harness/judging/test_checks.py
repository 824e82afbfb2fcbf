"""Every check judges a number that exists, and every number with a remedy is judged."""

from hil.experiments import EXPERIMENTS
from hil.judging.limits.checks import load_checks

UNJUDGED = {
    # The angle is the window's percentage in other units, and that is judged.
    ("excursion", "closed_angle", "thumb_abduction"),
}


def test_checks_and_metrics_with_a_remedy_name_each_other():
    """No check is on what no experiment measures, and no remedy waits for a finding that cannot come."""
    checked = {(check.experiment, check.metric, subject) for check in load_checks() for subject in check.subjects}
    metrics = {
        (experiment.name, metric.name, subject): metric
        for experiment in EXPERIMENTS.values()
        for metric in experiment.metrics
        for subject in metric.subjects
    }
    assert checked <= metrics.keys()
    assert {key for key, metric in metrics.items() if metric.remedy} - checked == UNJUDGED
