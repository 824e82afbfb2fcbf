"""Guarded program whose end requires, from the bytes, that the guard kept its promises."""

import numpy as np
from exchanged_signals import STEP_S, longest_s, signals
from guarded_program import GuardedProgram, step

from aero.protocol import Opcode
from aero.safety import Thresholds
from aero.safety.stop import Phase

QUERIES = {Opcode.GET_POS, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_TEMP}
UNWATCHED_S = 2.7
"""Time after homing without checks, s: the guard restarts, and its commands take time."""
LIMITS = Thresholds()
"""Published limits, independent of the guard's settings in a test."""
ENDING_S = 4 * LIMITS.opening_patience_s


class PromisedProgram(GuardedProgram):
    """As `GuardedProgram`; `broken` has the violated promises of an ended program's guard, with their excess.

    `late_s` is the tolerance beyond a threshold's duration: a poll, its exchanges, lost replies, the age of a value.
    """

    def __init__(self, *, late_s=0.2, **how):
        super().__init__(**how)
        self.late_s = late_s
        if self.built:
            self.excused = "a hand that may not be able to open"
        self.link.log = []
        self.start_s = self.clock.now()
        self.phases, self.homings, self.executed, self.broken = [], [], [], {}
        write = self.link.write

        def noted(data):
            self.phases.append((self.clock.now(), self.hand.phase))
            write(data)

        self.link.write = noted
        make = self.electronics._new_board
        self.electronics._new_board = lambda: self._overheard(make())
        self._overheard(self.electronics.board)

    @step
    def home(self):
        """Home the hand."""
        begun = self.clock.now()
        try:
            GuardedProgram.home.__wrapped__(self)
        finally:
            self.homings.append((begun - self.start_s, self.clock.now() - self.start_s + UNWATCHED_S))

    @step
    def end(self, how="normally", cut=0):
        """End the program, and require that every promise was kept."""
        begun = self.clock.now()
        try:
            GuardedProgram.end.__wrapped__(self, how, cut)
        finally:
            self._judge(begun)
        assert not self.broken, f"promises are broken: {self.broken}"

    def _overheard(self, board):
        take = board.next_frame

        def next_frame():
            frame = take()
            if frame is not None:
                self.executed.append(frame)
            return frame

        board.next_frame = next_frame
        return board

    def _judge(self, ended):
        log = [(t - self.start_s, direction, data) for t, direction, data in self.link.log]
        times, found = signals(log, self.clock.now() - self.start_s)
        moving, gentle = self._phases(times)
        moving &= times <= ended - self.start_s  # a killed program watches no more
        seen = moving & found["fresh"]
        late_s = self.late_s
        most = {
            "current": (longest_s(seen & (found["current"] > LIMITS.current_a)), LIMITS.current_s + late_s),
            "temperatures": (
                np.max(found["temperatures_age"], where=seen, initial=0.0),
                LIMITS.temperature_look_s + 3 * late_s,
            ),
            "stale": (np.max(found["stale"], where=moving, initial=0.0), LIMITS.stale_s + late_s),
            "silence": (np.max(found["silence"], where=moving, initial=0.0), LIMITS.silent_s + 7 * late_s),
            "beyond": (longest_s(seen & (found["beyond"] > LIMITS.beyond)), LIMITS.stray_s + late_s),
            "short": (longest_s(seen & (found["short"] > LIMITS.short)), LIMITS.stray_s + late_s),
            "gentle": (np.max(found["step"], where=gentle, initial=0.0), 1.1 * STEP_S / LIMITS.opening_s),
            "unasked": (self._unasked(log), 0),
            "ending": (max(self.left_s - ended, self._stopping_s()), ENDING_S),
        }
        self.broken = {name: f"{value:.3g} of {bound:.3g}" for name, (value, bound) in most.items() if value > bound}

    def _phases(self, times):
        """Return masks of motion under polls, and of the first opening."""
        at = np.searchsorted([t - self.start_s for t, _ in self.phases], times, side="right") - 1
        phases = [self.phases[i][1] if i >= 0 else Phase.RESTING for i in at]
        homing = np.zeros(len(times), bool)
        for begun, done in self.homings:
            homing |= (times >= begun - STEP_S) & (times <= done)
        moving = np.array([phase in {Phase.OPENING, Phase.MOVING} for phase in phases]) & ~homing
        return moving, np.array([phase is Phase.OPENING for phase in phases])

    def _stopping_s(self):
        """Return the duration of the last opening, s."""
        ending = [t for t, phase in self.phases if phase is Phase.ENDING]
        return ending[-1] - ending[0] if ending else 0.0

    def _unasked(self, log):
        """Return the number of commands executed by the board without having been sent."""
        asked = iter([data for _, direction, data in log if direction == ">"])
        return sum(
            frame[0] in {*Opcode} - QUERIES and not any(frame == one for one in asked) for frame in self.executed
        )
