"""System identification: units fitted to recordings of a hand, the actuation map fitted to the simulated one."""
