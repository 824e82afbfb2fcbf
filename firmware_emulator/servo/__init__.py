"""Feetech bus servo: registers, encodings, motion profile, electrical and thermal behaviour."""
