"""A guarded program whose end says how far the guard's promises were from being broken."""

import numpy as np
from guarded_program import SETTLES_S, GuardedProgram, step

from aero.protocol import Opcode
from aero.safety.opening import SWITCH_OFF
from aero.safety.state import Phase
from hil.targets.wire_log import WireRecord
from hil.verdict.margins import margin
from hil.verdict.promise_signals import signals
from hil.verdict.promises import PROMISES, STEP_S, YES

QUERIES = {Opcode.GET_POS, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_TEMP}
UNWATCHED_S = 2.7
"""After homing: the guard begins anew, and its commands need their time."""


class PromisedProgram(GuardedProgram):
    """As `GuardedProgram`; `margins` holds every promise's `Margin` by its name when the program has ended."""

    def __init__(self, **how):
        super().__init__(**how)
        if self.built:
            self.excused = "a hand that may not be able to open"
        self.link.log = []
        self.start_s = self.clock.now()
        self.phases, self.homings, self.executed = [], [], []
        self.margins = {}
        write = self.link.write

        def noted(data):
            self.phases.append((self.clock.now() - self.start_s, self.hand.phase))
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
        """End the program, see what it promised, and demand that nothing was broken."""
        begun = self.clock.now()
        try:
            GuardedProgram.end.__wrapped__(self, how, cut)
        finally:
            self._measure(begun - self.start_s)
        for found in self.margins.values():
            assert found.value >= 0.0, (
                f"promise {found.promise.name} is broken by {-found.value:.3g} {found.promise.unit}"
            )

    def _overheard(self, board):
        take = board.next_frame

        def next_frame():
            frame = take()
            if frame is not None:
                self.executed.append((self.clock.now() - self.start_s, frame))
            return frame

        board.next_frame = next_frame
        return board

    def _measure(self, ended_s):
        wire = [
            WireRecord(t - self.start_s, "to_hand" if direction == ">" else "from_hand", data)
            for t, direction, data in self.link.log
        ]
        end_s = self.clock.now() - self.start_s
        times, found = signals(wire, end_s)
        found |= self._phases(times)
        found["unasked"] = self._unasked(times, wire)
        left = np.where(times >= ended_s, np.minimum(times, end_s - SETTLES_S) - ended_s, 0.0)
        found["left"] = np.maximum(left, self._stopping(times))
        bent = np.abs(np.rad2deg(self._plant.joint_angles())).max()
        found["ended"] = np.where(np.arange(len(times)) == len(times) - 1, YES, -YES)
        found["bent"] = np.full(len(times), bent)
        found["told"] = np.full(len(times), YES if SWITCH_OFF in self.said or self.built else -YES)
        self.margins = {promise.name: margin(promise, times, found) for promise in PROMISES}

    def _phases(self, times):
        """Return whether the hand moves and is watched, and whether it opens for the first time."""
        at = np.searchsorted([t for t, _ in self.phases], times, side="right") - 1
        phases = [self.phases[i][1] if i >= 0 else Phase.RESTING for i in at]
        homing = np.zeros(len(times), bool)
        for begun, done in self.homings:
            homing |= (times >= begun - STEP_S) & (times <= done)
        moving = np.array([phase in {Phase.OPENING, Phase.MOVING} for phase in phases]) & ~homing
        gentle = np.array([phase is Phase.OPENING for phase in phases])
        return {"moving": np.where(moving, YES, -YES), "gentle": np.where(gentle, YES, -YES)}

    def _stopping(self, times):
        """Return for how long the hand has been opening for the last time, s."""
        begun = next((t for t, phase in self.phases if phase is Phase.ENDING), None)
        done = max((t for t, phase in self.phases if phase is Phase.ENDING), default=0.0)
        return np.zeros(len(times)) if begun is None else np.clip(np.minimum(times, done) - begun, 0.0, None)

    def _unasked(self, times, wire):
        """Return how many commands the board has carried out that nobody had sent."""
        asked = iter([record.data for record in wire if record.direction == "to_hand"])
        count = np.zeros(len(times))
        for t, frame in self.executed:
            if frame[0] in {*Opcode} - QUERIES and not any(frame == one for one in asked):
                count[times >= t] += 1.0
        return count
