"""Web page on this machine that shows a hand, live or from a recording.

A separate process serves the page, so that no browser can block the program that drives the hand.
"""
