"""Simulated owner at a terminal: reads the prompts of `diagnose`, types answers, and acts on a hand of `emulate`.

The owner knows only the output of both. `emulate` represents the hand: typed acts are done to it, and its output is the
observation by hands, eyes and instruments.
"""

import json
import re
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress
from queue import Queue

from owner import OFF
from pages import environment

from aero.channels import Channel
from aero.exit_code import Exit
from hil.checks.shared.subjects import subject_words

ASKS = "> "
"""End of a prompt."""
SHOWN_S = 120
"""Time-out for the visible effect of an act, s."""
NO_ACT = "no_such_act"
"""Word that the prompt refuses by name."""
TRIES = 5
"""Limit of repetitions of an inconclusive validation."""
BENT = {
    "Swing the thumb": Channel.THUMB_ABDUCTION,
    "thumb by hand at its base": Channel.THUMB_CMC_FLEXION,
    "tip of the thumb": Channel.THUMB_FLEXOR,
}
"""Channels of the thumb by the words of their manual motion."""
MOST_PROMPTS = 60
"""Limit of prompts, for example on a computer that is busy in every run."""
DOES = (
    (r"Mend what was found", "power_off;replace digit {0};power_on"),
    (r"Exchange it with", "exchange_servos {0} {1}"),
    (r"reseat every plug", "power_off;replace bus;power_on"),
    (r"another supply", "power_off;replace supply;power_on"),
    (r"another short USB cable", "replace usb"),
    (r"Flash the named", "flash"),
    (r"Put another board", "replace board"),
    (r"[Tt]ake everything out", "power_off;let_go;power_on"),
    (r"Switch the hand's supply off", "power_off;power_on"),
)
"""Text of a step to the act of its reader; `{0}` is the first digit in the text. Other steps have no effect."""
LOOKS = (
    (r"Bend|Swing", "feel {0}"),
    (r"Look along the cable", "look {0}"),
    (r"version was flashed", "flashed"),
    (r"the voltage", "voltage"),
    (r"bus adapter", "registers"),
    (r"take away", "let_go"),
)
"""Text of a question to the inspection by its reader."""


class ServedHand:
    """Hand served by `emulate`."""

    def __init__(self, process):
        self._process, self._said = process, Queue()
        threading.Thread(target=self._hear, daemon=True).start()

    def _hear(self):
        with suppress(ValueError):  # closed at the end
            for line in self._process.stderr:
                self._said.put(line.strip())

    def do(self, words):
        """Perform an act and return the resulting output."""
        self._until_refused()  # what the hand has said since the last act
        # A refusal is printed before what acts of the same turn show, so a second one comes after all of it.
        return "; ".join((*self._until_refused(words), *self._until_refused()))

    def _until_refused(self, *words):
        """Type lines, then a line that is refused; return the output until then."""
        self._process.stdin.write("".join(f"{line}\n" for line in (*words, NO_ACT)))
        self._process.stdin.flush()
        shown = []
        while NO_ACT not in (line := self._said.get(timeout=SHOWN_S)):
            shown.append(line)
        return shown


@contextmanager
def served(link, *options):
    """Serve a hand on a port during the block."""
    with subprocess.Popen(
        [sys.executable, "-m", "aero_hil", "emulate", "--link", str(link), "--prompt", *options],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(),
    ) as process:  # fmt: skip
        try:
            while not (line := process.stdout.readline()).startswith("ready"):
                assert line, process.stderr.read()
            yield ServedHand(process)
        finally:
            process.terminate()


def first_run(folder, link, *options, again_if_late=True):
    """Validate the hand on a port, repeatedly on a busy computer; return exit code and output.

    The emulated board is on the same computer, so that its late replies say nothing about the hand either.
    """
    code, said = Exit.HOST_BUSY, ""
    for _ in range(TRIES):
        if code == Exit.HOST_BUSY or (again_if_late and "stalls" in _failed(folder)):
            ran = subprocess.run(
                [sys.executable, "-m", "aero_hil", "validate", "--hil", str(link), "--out", str(folder), *options],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment(), check=False,
            )  # fmt: skip
            code, said = ran.returncode, ran.stdout
    return code, said


def _failed(folder):
    """Return the failed checks of the case of a run; none without a case."""
    case = folder / "case.json"
    groups = json.loads(case.read_text())["groups"] if case.exists() else []
    return {check for group in groups for _, check, *_ in group["failed"]}


def diagnosed(folder, link, hand, *, named=""):
    """Complete a case; return exit code and all output.

    `named` is the owner's declaration of the board: `0.2.0, for a right hand`.
    """
    with subprocess.Popen(
        [sys.executable, "-m", "aero_hil", "diagnose", str(folder), "--hil", str(link)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment(),
    ) as process:  # fmt: skip
        said, prompts = "", 0
        while (prompt := _until_asked(process.stdout)).endswith(ASKS):
            said += prompt
            prompts += 1
            assert prompts < MOST_PROMPTS, said
            step = re.sub(r"\s+", " ", said.rpartition("next step")[2])
            process.stdin.write(f"{_answer(hand, prompt, step, named)}\n")
            process.stdin.flush()
        said += prompt
    return process.returncode, said


def _until_asked(out):
    text = ""
    while not text.endswith(ASKS) and (char := out.read(1)):
        text += char
    return text


def _answer(hand, prompt, step, named):
    asked = re.sub(r"\s+", " ", prompt)
    if "y yes" in asked:
        question = asked if "take away" in asked else step
        seen = hand.do(_words(LOOKS, question))
        return "y" if sees(f"{seen}; named: {named}" if "flashed" in seen else seen) else "n"
    if "marked servo" in asked or "three times" in asked:
        digits = _digits(step if "marked servo" in asked else asked)
        return str(1 + digits["marked servo" in asked])
    if "'done'" in asked:
        for words in filter(None, _words(DOES, step).split(";")):
            hand.do(words)
    if asks := re.search(r"type '(.+?)'", asked):
        return asks[1]
    return "a" if "a all is connected" in asked else ""


def _words(table, text):
    digits = [channel.label for channel in _digits(text)]
    return next((words.format(*digits) for pattern, words in table if re.search(pattern, text)), "")


def _digits(text):
    """Return the channels of a text, in their order there."""
    names = {**{subject_words(channel.label): channel for channel in Channel}, **BENT}
    return [names[name] for name in sorted(names, key=text.find) if name in text]


def sees(text):
    """Return whether an observation means yes: a difference, a removed object, or a wrong voltage."""
    if "the supply gives" in text:
        *measured, usual = map(float, re.findall(r"([\d.]+) V", text))
        return any(abs(volts / usual - 1.0) > OFF for volts in measured)
    if flashed := re.search("flashed: ([^;]*).*; named: (.*)", text):
        return flashed[1] != flashed[2]
    if looked := re.findall(r"(?:bent \w+|looked at \w+|read the \w+): ([^;]*)", text):
        return looked[0] != "nothing differs"
    return "nothing to take" not in text
