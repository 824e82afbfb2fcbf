"""Emulated full disk: a limit on the file size, which needs no privileges."""

import os
import resource
import sys
from contextlib import contextmanager

available = os.name == "posix"


@contextmanager
def full_disk(size=0):
    """Limit the size of files to `size` bytes during the block."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    writes_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # half a .pyc fails every later import
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        sys.dont_write_bytecode = writes_bytecode


def limited(size):
    """Return the start of a command line that runs its remainder on an emulated full disk."""
    limit = f"import os, resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))"
    without = "os.environ['PYTHONDONTWRITEBYTECODE'] = '1'"
    return [sys.executable, "-c", f"{limit}; {without}; os.execv(sys.argv[1], sys.argv[1:])"]
