"""A file system that takes no more: a limit on the size of files, which needs no rights."""

import os
import resource
import sys
from contextlib import contextmanager

available = os.name == "posix"


@contextmanager
def full_disk(size=0):
    """Let no file grow beyond `size` bytes meanwhile."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    writes_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # half a .pyc fails every later import
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        sys.dont_write_bytecode = writes_bytecode


def limited(size):
    """Return the beginning of a command line that runs the rest of it on such a file system."""
    limit = f"import os, resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))"
    without = "os.environ['PYTHONDONTWRITEBYTECODE'] = '1'"
    return [sys.executable, "-c", f"{limit}; {without}; os.execv(sys.argv[1], sys.argv[1:])"]
