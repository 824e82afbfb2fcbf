"""Guarded program on an emulated hand, as steps with faults, and the invariants after any steps.

A failed invariant reports the steps so far as a script that runs with `tests/support` on the search path.
"""

import functools
import signal
import struct
from contextlib import ExitStack

import numpy as np
import pytest
from guarded_hands import FailingLink
from overheard_line import OverheardLine

from aero import AeroHand, Channel
from aero.actuation import ActuationMap
from aero.errors import AeroError
from aero.firmware import firmware_of
from aero.protocol import MAX_CODE, Opcode
from aero.safety import SafetyStopError, Thresholds, unwinding
from aero.safety.__main__ import open_what_was_left
from aero.safety.opening import SWITCH_OFF
from aero.safety.stop import Phase
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults import parse_fault
from hil.emulated.faults.fault import FaultLayer
from hil.emulated.faults.link_faults import LinkFaults
from hil.targets.opening import guard
from model.units.plausible import unit_named

OPEN_DEG = 25.0
"""Largest angle of any joint of an open hand, degrees: a thumb joint rests at 19 in the windows of firmware 0.1.0."""
INTERRUPTS = (KeyboardInterrupt, SystemExit)
HOMING_S = 20.0
SETTLES_S = 0.5
MOVES = {bytes((opcode,)) for opcode in (Opcode.HOMING, Opcode.CTRL_POS, Opcode.CTRL_TOR)}
STARTS_S = 8.0
"""Time for a board to start and home, s."""


def step(method):
    """Record a step as a line of the script, which is attached to any exception."""

    @functools.wraps(method)
    def noted(self, *arguments, **named):
        texts = [*map(repr, arguments), *(f"{name}={value!r}" for name, value in named.items())]
        self.lines.append(f"program.{method.__name__}({', '.join(texts)})")
        try:
            return method(self, *arguments, **named)
        except BaseException as error:
            error.add_note(self.script())
            raise

    return noted


class GuardedProgram:
    """Program on an emulated hand, on the virtual clock.

    Every step raises an `AssertionError` if the driver returns a value that the board has not sent since the request,
    raises an undeclared error, or accepts a command after a stop. `end` raises one if the hand is left closed.
    """

    def __init__(self, *, firmware="0.2.0", seed=0, unit="reference", faults=(), after=None):
        """Start a program on a new hand, or on the hand of an earlier program, `after`.

        `faults` are built-in faults of the hand with their start times in s after it is ready.
        """
        self.firmware = firmware
        built = f", faults={list(faults)!r}" if faults else ""
        self.lines = [f"program = {type(self).__name__}(firmware={firmware!r}, seed={seed}, unit={unit!r}{built})"]
        if after is None:
            spec = EmulatedSpec(firmware=firmware, seed=seed, faults=tuple(faults))
            self.electronics, self._bench = build_emulated(unit_named(unit), spec)
        else:
            self.electronics, self._bench = after.electronics, after._bench
        self._seed = seed
        self.line = self.electronics.link_faults = OverheardLine()
        self.clock = self.electronics.clock
        self.link = FailingLink(self.electronics)
        self._thresholds = Thresholds()
        self.hand = guard(
            self.link, self.clock, ActuationMap.for_firmware(firmware), firmware, self._thresholds, standby=None
        )
        link = self.hand._hand._link
        self._ask, link.ask = link.ask, self._asked
        self.built = faults
        self.over = self.ended = self._restarted_since = self._sent = False
        self.excused = self.said = ""
        self.exchanges = self.errors = 0
        self._signals = ExitStack()
        self._signals.callback(signal.signal, signal.SIGINT, signal.getsignal(signal.SIGINT))
        signal.signal(signal.SIGINT, signal.default_int_handler)
        self._signals.enter_context(unwinding())

    def script(self):
        """Return the steps so far as a program."""
        name = type(self).__name__
        module = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name).lstrip("_")
        return "\n".join([f"from {module} import {name}", "", *self.lines])

    @step
    def command(self, codes, wait_s=0.0):
        """Send all channels to codes (7,), and wait on the hand's clock."""
        self._do(lambda: (self.hand.command_codes(codes), self._wait(wait_s)))

    @step
    def torques(self, magnitudes, wait_s=0.0):
        """Pull channels closed, and wait."""
        self._do(lambda: (self.hand.command_torques(magnitudes), self._wait(wait_s)))

    @step
    def limit(self, what, channel, value):
        """Set a limit: `speed` or `torque`."""
        self._do(lambda: getattr(self.hand, f"set_{what}")(Channel(channel), value))

    @step
    def expect_stops(self, channels):
        """Restore the usual limits, with weaker ones on some channels."""
        self._do(lambda: self.hand.expect_stops(map(Channel, channels)))

    @step
    def read(self, what):
        """Read `codes`, `currents`, `temperatures` or `speeds`."""
        self._do(getattr(self.hand, f"read_{what}"))

    @step
    def poll(self, seconds):
        """Read positions at 50 Hz, with waits on an unguarded clock."""

        def polling():
            until = self.clock.now() + seconds
            while self.clock.now() < until:
                self.clock.sleep_until(self.clock.now() + 0.02)
                self.hand.read_codes()

        self._do(polling)

    @step
    def wait(self, seconds):
        """Wait on the hand's clock."""
        self._do(lambda: self._wait(seconds))

    @step
    def sleep(self, seconds):
        """Wait without polls, as on a suspended machine."""
        self._do(lambda: self.clock.sleep_until(self.clock.now() + seconds))

    @step
    def home(self):
        """Home the hand."""
        self._do(lambda: self.hand.home(HOMING_S))

    @step
    def resynchronise(self):
        """Resynchronise the board."""
        self._do(self.hand.resynchronise)

    @step
    def use_in_forked_process(self):
        """Let a forked process with a copy of the hand command and close it."""
        self.hand._guard._owner += 1
        written = self.exchanges
        try:
            for call in (self.hand.read_codes, lambda: self.hand.command_codes([MAX_CODE] * 7)):
                with pytest.raises(SafetyStopError, match="this process was forked"):
                    call()
            self.hand.close()
        finally:
            self.hand._guard._owner -= 1
        assert self.exchanges == written

    @step
    def fault(self, text, after_s=0.0):
        """Inject a fault `after_s` from now; a link fault replaces the previous one."""
        self._later(after_s, self._put_in, parse_fault(text))

    @step
    def heal_link(self, after_s=0.0):
        """Clear the faults of the link."""
        self._later(after_s, setattr, self.line, "faults", None)

    @step
    def stray_bytes(self, count, after_s=0.0):
        """Leave a fragment of another program's frame in the board's buffer."""
        self._later(after_s, self._arrive, b"\x7f" * count)

    @step
    def torque_mode_of_servos(self, after_s=0.0):
        """Switch the servos to torque mode without the board's knowledge, as by a restart during a mode change."""
        self._later(after_s, self._lose_mode)

    @step
    def unplug(self, after_s=0.0):
        """Remove the port."""
        self._later(after_s, self._unplug)

    @step
    def signal(self, name, after_s=0.0):
        """Send this process a signal in `after_s`."""
        self._later(after_s, self._send, getattr(signal, name))

    @step
    def end(self, how="normally", cut=0):
        """End the program, and require an open hand or instructions to the user.

        `how` is `normally`, the name of an exception that ends the program's block, or `killed`: then the second
        process opens the hand, after the first `cut` bytes of a last command.
        """
        self.ended = True
        try:
            if self.over or how != "killed":
                self._leave(how)
            else:
                self._killed(cut)
        finally:
            self.over, self.left_s = True, self.clock.now()
            self._signals.close()
        self._demand_open()

    def next_owner(self):
        """Prepare the hand for the next program as a user does: clear the link faults and restore the power."""
        self.line.faults = None
        self.electronics.reset("power_on")
        self.clock.sleep_until(self.clock.now() + STARTS_S)

    def _send(self, number):
        self._sent = True
        signal.raise_signal(number)

    def _interrupted(self):
        """Exit the block of the hand by a signal, except for Ctrl-C of a person who ends the tests."""
        if not self._sent:
            raise  # noqa: PLE0704 - called where one is being handled
        self._leave("KeyboardInterrupt")
        self.over = True

    def _leave(self, how):
        """Exit the block of the hand like the `with` statement."""
        raised = {"normally": None, "KeyboardInterrupt": KeyboardInterrupt(), "SystemExit": SystemExit(1)}
        error = raised[how] if how in raised else RuntimeError(how)
        try:
            self.hand.__exit__(type(error) if error else None, error, None)
            self.hand.close()
        except SafetyStopError as stop:
            self.said = str(stop)
        except INTERRUPTS:
            pass  # a signal that was held back until the hand was open

    def _killed(self, cut):
        self.over = True
        self.hand._finalizer.detach()  # as in a process that is gone
        if self.hand.phase in {Phase.RESTING, Phase.STOPPED}:
            return  # no second process was started, or it was stood down
        if not self.link.unplugged:
            self._arrive((b"\x11\x00" + b"\xff" * 14)[:cut])
        link = FailingLink(self.electronics)
        link.log = self.link.log
        link.unplugged = self.link.unplugged
        settable = firmware_of(self.firmware).settings is not None
        doubt = open_what_was_left(lambda: AeroHand(link, self.clock), self.clock, self._thresholds, settable=settable)
        self.said = f"{SWITCH_OFF}, because {doubt}" if doubt else ""

    def _demand_open(self):
        commanded = self.link.log is None or any(way == ">" and data[:1] in MOVES for _, way, data in self.link.log)
        # A board that has started homes by itself; one that hangs meanwhile leaves bent what no program has moved.
        self.clock.sleep_until(self.clock.now() + (SETTLES_S if commanded else STARTS_S))
        self.electronics.advance_plant()
        bent = np.abs(np.rad2deg(self._bench.mechanics.joint_angles())).max()
        told = SWITCH_OFF in self.said or bool(self.built) or not commanded
        assert bent < OPEN_DEG or (told and self.excused), (
            f"the hand is left {bent:.0f} degrees bent, although its board answers; said: {self.said!r}, "
            f"excuse: {self.excused!r}"
        )
        if self.hand.phase is Phase.STOPPED and not self._restarted_since and self.firmware != "pre" and not told:
            limits = [servo.memory.get("goal_torque") for servo in self.electronics.servos]
            assert limits == [self._thresholds.limp_torque] * 7, f"the hand is left with torque limits {limits}"

    def _do(self, call):
        """Execute a request of the program, and permit the declared errors."""
        if self.over:
            return
        stopped = self.hand.phase is Phase.STOPPED
        before = self.exchanges
        try:
            call()
        except AeroError:
            self.errors += 1
        except ConnectionError:
            self.errors += 1
            assert self.link.unplugged, "the link is said to be gone, and is not"
        except SafetyStopError as stop:
            self.said = str(stop)
        except INTERRUPTS:
            self._interrupted()
        assert not stopped or self.exchanges == before, "a stopped hand took a call"

    def _asked(self, frame, *how):
        """Exchange a frame, and require that the board has sent the reply since the request."""
        self.exchanges += 1
        answer = self._ask(frame, *how)
        raw = struct.pack("<BB7H", answer.reply.opcode, 0, *answer.reply.words)
        fresh = [data for t, data in self.line.sent if t >= answer.asked]
        assert raw in fresh, (
            f"asked {frame.hex(' ')} at {answer.asked:.4f} s, the driver returned {raw.hex(' ')}, "
            f"the board had sent {[data.hex(' ') for data in fresh]}"
        )
        return answer

    def _wait(self, seconds):
        self.hand.clock.sleep_until(self.clock.now() + seconds)

    def _later(self, after_s, act, *arguments):
        if self.over:
            return
        if after_s:
            self.electronics.kernel.call_at(self.clock.now() + after_s, self._unless_over, act, *arguments)
        else:
            try:
                act(*arguments)
            except INTERRUPTS:
                self._interrupted()

    def _unless_over(self, act, *arguments):
        if not self.over:
            act(*arguments)

    def _put_in(self, fault):
        if fault.fault.layer in (FaultLayer.BOARD, FaultLayer.SERVO):
            fault.fault.inject(self._bench.assembly, fault).begin()
            self._restarted_since |= self.hand.phase is Phase.STOPPED
            if fault.name in {"board_hangs", "servo_missing"}:
                self.excused = fault.name
        else:
            self.line.faults = self._bench.assembly.link = LinkFaults(lambda _fault: None)
            self._bench.assembly.link.say = self.electronics.say
            fault.fault.inject(self._bench.assembly, fault).begin()

    def _arrive(self, data):
        self.electronics.board.receive(data)

    def _lose_mode(self):
        for servo in self.electronics.servos:
            servo.memory.set("mode", 2)

    def _unplug(self):
        self.link.unplugged, self.excused = True, "unplugged"
