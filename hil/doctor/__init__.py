"""What a new owner runs first: this machine, its serial ports and, at rest, the hand; nothing moves or changes.

Small checks, each of which returns a `Finding`. Works with what `pip install aero-hil` installs and no extra.
"""
