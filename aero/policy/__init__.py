"""What running a policy on a hand needs: the task's interface, policy files, the network, the loop. NumPy only."""
