"""Command that serves a port, in a process, and the recording of the bytes that reached its hand."""

import re
import signal
import subprocess
import sys
from contextlib import contextmanager

from aero.protocol import READINGS
from hil.recordings.mcap_file import read_recording

PATIENCE_S = 60.0


class Served:
    """Command that serves a port, with everything that it prints."""

    def __init__(self, process):
        self.process, self.said = process, ""

    def says(self, pattern):
        """Wait for a line."""
        while not (found := re.search(pattern, self.said, re.M)):
            line = self.process.stdout.readline()
            assert line, f"ended before {pattern!r}: {self.said}"
            self.said += line
        return found

    def types(self, text):
        self.process.stdin.write(text)
        self.process.stdin.flush()


@contextmanager
def serving(*arguments, folder, code=0, stop=signal.SIGTERM):
    """Yield a command once it is ready; end it by a signal, and check its exit code."""
    command = [sys.executable, "-m", "hil.cli", *map(str, arguments)]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True, bufsize=1, cwd=folder
    ) as process:
        served = Served(process)
        try:
            served.says("^ready ")
            yield served
        finally:
            process.send_signal(stop)
            rest, _ = process.communicate(timeout=PATIENCE_S)
            served.said += rest
        assert process.returncode == code, served.said


def commands(path):
    """Return the frames of a recording that are not queries."""
    frames = [record.data for record in read_recording(path).wire if record.direction == "to_hand"]
    return [frame for frame in frames if frame[0] not in READINGS]
