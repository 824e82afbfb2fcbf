"""Running a policy on a hand: task interface, policy files, network, control loop. Depends on NumPy only."""
