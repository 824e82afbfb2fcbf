"""Ways to reach an emulated hand: in this process on virtual time, or over a pseudo-terminal in real time."""
