"""Emulated hands for the instrument: assembly, faults, acts, served ports. Imported by nothing below it."""
