"""Recordings: what a run leaves behind, on disk as MCAP, and sent to a hand again."""
