"""Common parts of the experiments: description, motion of a hand, operations on recordings."""
