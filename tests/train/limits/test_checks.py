"""Every check judges a number that exists, and every number with a remedy is judged."""

from hil.checks import CHECKS, JUDGED

UNJUDGED = {
    # Healthy hands differ by more than any fault moves it.
    ("audit", "pull", "thumb_abduction"),
    # In the fist the thumb meets the fingers, each hand elsewhere.
    ("excursion", "fist_travel", "thumb_cmc_flexion"),
    ("excursion", "fist_travel", "thumb_flexor"),
}


def test_checks_and_metrics_with_a_remedy_name_each_other():
    """No check is on what no experiment measures, and no remedy waits for a finding that cannot come."""
    checked = {(check.experiment, check.metric, subject) for check in CHECKS for subject in check.subjects}
    metrics = {
        (experiment.name, metric.name, subject): metric
        for experiment in JUDGED.values()
        for metric in experiment.metrics
        for subject in metric.subjects
    }
    assert checked <= metrics.keys()
    assert {key for key, metric in metrics.items() if metric.low.remedy or metric.high.remedy} - checked == UNJUDGED
