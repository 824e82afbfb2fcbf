"""A file system that takes no more: a limit on the size of files, which needs no rights."""

import errno
import os
import resource
import sys
from contextlib import contextmanager

from hil.recordings import errors

FULL = errno.EFBIG
"""What a write beyond the limit raises; a full disk raises ENOSPC."""


@contextmanager
def full_disk(monkeypatch, size=0):
    """Let no file grow beyond `size` bytes meanwhile."""
    monkeypatch.setattr(errors, "FULL_DISK", {*errors.FULL_DISK, FULL})
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def limited(size):
    """Return the beginning of a command line that runs the rest of it on such a file system."""
    limit = f"import os, resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))"
    return [sys.executable, "-c", f"{limit}; os.execv(sys.argv[1], sys.argv[1:])"]


available = os.name == "posix"
