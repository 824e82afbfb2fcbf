"""See a hand move: a web page on this machine, live or from a recording.

The page is served by a process of its own, so that whatever a browser does, the hand's program does not wait for it.
"""
