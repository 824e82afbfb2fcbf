"""Which faults explain all the numbers of a run, and what would tell the likeliest two apart."""
