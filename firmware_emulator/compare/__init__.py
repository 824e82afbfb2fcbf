"""Comparison of two firmwares in equal seeded sessions, up to their first difference."""
