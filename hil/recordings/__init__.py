"""Recordings of experiments, and their MCAP files."""
