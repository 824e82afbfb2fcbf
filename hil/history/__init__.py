"""History of one hand: readings of its runs by date, and drift towards limits."""
