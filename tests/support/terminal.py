"""Terminal of a page's reader: commands in sequence in one folder; a server runs until the next one starts."""

import re
import shlex
import signal
import subprocess
from contextlib import ExitStack, contextmanager

from extras import activated
from pages import LIMIT_S, ROOT, missing

from aero import AeroHand

SERVERS = re.compile(r"aero-hil (emulate|view|proxy|guard)\b")
"""Commands that run until Ctrl-C."""
PORTS = ("/dev/ttyACM0", "/dev/ttyACM1")
SHORTER = {
    r"aero-hil validate\b.* --hil (?!.*--dry-run)(?!.*--only)": "--only presence --only audit",
    r"aero-hil validate --unit \S+\.toml$": "--only presence --only audit",
    r"aero-hil record\b(?!.*--dry-run)": "--excite steps --channel index --scale 0.4",
    r"aero-hil run-policy\b.* --hil ": "--seconds 3 --wait 0",
    r"aero-hil evaluate\b": "--units 1 --episodes 2 --seconds 2",
}
"""Command to additional options that shorten it in tests."""
TYPED = {r"aero-hil diagnose(?!.*--hil)": "n\nm\n" * 60}
"""Command to the typed input: no to each question, each step by the program."""


class Terminal:
    """Shell in a folder, with emulated hands on the ports of pages, and the programs of one environment."""

    def __init__(self, folder, stack: ExitStack, programs):
        self.folder, self.stack, self.variables = folder, stack, activated(programs)
        self.ports, self.serving = {}, stack.enter_context(ExitStack())

    def port(self, name):
        """Serve a homed hand, once for each name."""
        if name not in self.ports:
            link = self.ports[name] = str(self.folder / name.replace("/dev/", ""))
            self.stack.enter_context(self.served(f"aero-hil emulate --link {link} --seed 5"))
            with AeroHand.open_unguarded(link) as hand:
                hand.home()
        return self.ports[name]

    def type(self, command, shown=(), *, codes=frozenset({0})):
        """Run a command, or start a server; check output and exit code, and return the output."""
        command = command.replace("/tmp/", f"{self.folder}/").replace("examples/", f"{ROOT}/examples/")
        command = command.replace("tests/hil", f"{ROOT}/tests/hil -p no:cacheprovider")
        for name in PORTS:
            if name in command:
                command = command.replace(name, self.port(name))
        if SERVERS.match(command) and "--help" not in command:
            self.serving.close()
            self.serving.enter_context(self.served(command, shown))
            return ""
        more = [options for pattern, options in SHORTER.items() if re.match(pattern, command)]
        ran = subprocess.run(
            " ".join([command, *more]), shell=True, cwd=self.folder, env=self.variables, text=True, timeout=LIMIT_S,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
            input="".join(typed for pattern, typed in TYPED.items() if re.match(pattern, command)),
        )  # fmt: skip
        assert ran.returncode in codes, f"{command}\n{ran.stdout[-3000:]}"
        assert not missing(shown, ran.stdout), f"{command}\n{ran.stdout[-3000:]}"
        return ran.stdout

    @contextmanager
    def served(self, command, shown=()):
        """Yield a server from its first output (`ready` or `view`) until Ctrl-C."""
        with subprocess.Popen(
            shlex.split(command), cwd=self.folder, env=self.variables, text=True, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as server:  # fmt: skip
            said = ""
            while missing(shown, said) if shown else not re.search(r"^(ready|view) ", said, re.M):
                line = server.stdout.readline()
                assert line, f"{command} ended and printed {said!r}"
                said += line
            try:
                yield
            finally:  # else a failed command would leave it waiting for its server
                server.send_signal(signal.SIGINT)
