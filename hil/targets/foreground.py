"""Job control of the shell: reading or flushing a terminal from the background stops a process, and its guard."""

import os


def in_foreground(end: int) -> bool:
    """Return whether this process may read a descriptor; False only for the terminal of a job in the background."""
    try:
        return not os.isatty(end) or os.tcgetpgrp(end) == os.getpgrp()
    except OSError:  # not this session's terminal, or one that hung up
        return True
