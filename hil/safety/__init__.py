"""Safety around an experiment: which hand is guarded, what a run would move, and what its reader is told."""
