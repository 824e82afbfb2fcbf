"""Every check judges a number that exists, and every number with a remedy is judged."""

from hil.checks import CHECKS, JUDGED

UNJUDGED = {
    # Healthy hands differ by more than any fault moves it.
    ("audit", "pull", "thumb_abduction"),
    # In the fist the thumb meets the fingers, each hand elsewhere.
    ("excursion", "fist_travel", "thumb_cmc_flexion"),
    ("excursion", "fist_travel", "thumb_flexor"),
}
WITHOUT_LIMITS = {"alike", "spring_shape", "load_jump", "dry_friction", "friction_scatter", "late_steps", "lower_byte"}
WITHOUT_LIMITS |= {"standstill", "stale"}
"""Checks, and metrics, whose limits the next campaign makes."""


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
    with_remedy = {key for key, metric in metrics.items() if metric.remedy and not {*key} & WITHOUT_LIMITS}
    assert with_remedy - checked == UNJUDGED
