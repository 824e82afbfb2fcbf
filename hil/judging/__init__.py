"""Judging: what was measured against limits, against a hand's own baseline, and beside the paper."""
