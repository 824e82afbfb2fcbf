"""Limits from the readings of healthy hands."""
