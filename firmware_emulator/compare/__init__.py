"""Two firmwares, the same seeded sessions, and the first thing in which they differ."""
