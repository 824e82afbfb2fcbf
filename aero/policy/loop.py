"""Control loop of a policy on a hand: read, map back, observe, act, map forward, write, at the policy's rate.

`run_policy` serves an emulated hand on the virtual clock and a real hand on the wall clock. It moves slowly to the
nominal grasp, waits there for the object, runs the policy, and moves slowly back, also after an error. A hand stopped
by its guard is already open and is not moved again.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aero.actuation.map import ActuationMap
from aero.clock import Clock, WallClock
from aero.errors import AeroError
from aero.floats import Floats
from aero.hand import Hand
from aero.policy.file import Policy
from aero.policy.interface import History, Interface, cube_interface
from aero.policy.running import Ending, Run, RunSettings, Step, slewed
from aero.policy.task import CHANNELS
from aero.protocol import MAX_CODE
from aero.safety import SafetyStopError


def run_policy(
    policy: Policy,
    hand: Hand,
    clock: Clock,
    actuation_map: ActuationMap,
    *,
    settings: RunSettings | None = None,
    on_wait: Callable[[], None] = lambda: None,
    on_ready: Callable[[], None] = lambda: None,
    on_step: Callable[[Step], None] = lambda _: None,
) -> Run:
    """Run `policy` on `hand` and return the hand to its initial position.

    Args:
        policy: the policy.
        hand: guarded (currents, temperatures and encoders polled) or unguarded hand.
        clock: clock of the hand; a guarded hand has its own.
        actuation_map: map for the hand's firmware.
        settings: settings of the run; None for the defaults.
        on_wait: called in the nominal grasp, when the object can be placed.
        on_ready: called after the wait, just before the first action.
        on_step: called after every control period, before the next one.

    Raises:
        AeroError, ConnectionError: a failed reading before the policy started, or a failed command at the end.
    """
    settings = settings or RunSettings()
    session = _Session(policy, hand, clock, actuation_map, settings)
    home = hand.read_codes().astype(np.float64)
    session.command = home
    try:
        session.move_to(session.asked(np.zeros(CHANNELS))[1])  # the nominal grasp
        on_wait()
        clock.sleep_until(clock.now() + settings.wait_s)
        on_ready()
        ending = session.loop(on_step)
        session.move_to(home)
    except SafetyStopError as stop:
        return replace(session.tally, ending=Ending.STOPPED, reason=str(stop))  # the guard has opened the hand
    except BaseException:
        session.move_to(home)
        raise
    return replace(session.tally, ending=ending)


def interface_of(policy: Policy, settings: RunSettings) -> Interface:
    """Return the interface of `policy` under the overrides in `settings`.

    Raises:
        ValueError: an override of the cube task's settings for a policy that declares its interface.
    """
    if settings.settings is None and settings.shown_action is None:
        return policy.interface
    if policy.declared is not None:
        raise ValueError(f"{policy.name} declares its interface, so settings and delay cannot be changed")
    return cube_interface(settings.settings or policy.settings, settings.shown_action or policy.shown_action)


MISSING_READINGS = 4
"""Largest number of consecutive missing readings; the last command is kept meanwhile."""
LATE_S = 0.5
"""Threshold of a period's delay, s; above it the run ends with OVERRUN."""
TEMPERATURES_EVERY = 20
"""Periods between two temperature readings."""
APPROACH_PERIOD_S = 0.05
"""Command period of the slow approach and return, s; a policy's own period may be too long for a smooth motion."""
MOST_LATE = 0.25
"""Threshold of the skipped fraction of periods; above it the run ends with TOO_SLOW."""
_WALL = WallClock()
_NOTHING_YET = Run(Ending.TIME, "", 0, 0, 0, 0, 0.0, 0.0, np.nan)


class _Session:
    """State of one run."""

    def __init__(
        self,
        policy: Policy,
        hand: Hand,
        clock: Clock,
        actuation_map: ActuationMap,
        settings: RunSettings,
    ) -> None:
        self._policy, self._hand, self._clock, self._map = policy, hand, clock, actuation_map
        self._settings = settings
        self._task = settings.settings or policy.settings
        self._interface = interface_of(policy, settings)
        self._correction = np.array(settings.correction)
        window = actuation_map.window_rad
        codes_per_rad = MAX_CODE / (window[:, 1] - window[:, 0])
        self._most = settings.shaft_speed_rad_s * self._task.period_s * codes_per_rad
        self.command = np.zeros(CHANNELS)
        self._blind = 0
        self.tally = _NOTHING_YET

    def move_to(self, goal: Floats) -> None:
        """Ramp from the current command to codes `goal` (7,) at constant speed."""
        steps = max(1, round(self._settings.approach_s / APPROACH_PERIOD_S))
        start, begin = self.command, self._clock.now()
        for step in range(1, steps + 1):
            self._write(start + (goal - start) * step / steps)
            self._clock.sleep_until(begin + step * APPROACH_PERIOD_S)

    def loop(self, on_step: Callable[[Step], None]) -> Ending:
        """Run the policy until the time is over or a condition in `Ending` is met."""
        period_s = self._task.period_s
        history = History(self._interface, self._map)
        missing, due = 0, self._clock.now()
        pending = self.command
        end = due + self._settings.seconds - period_s / 2  # half a period early, so that rounding adds no period
        periods = round(self._settings.seconds / period_s)
        begun = 0
        while max(due, self._clock.now()) < end and begun < periods:
            self._clock.sleep_until(due)
            begun += 1
            t = self._clock.now()
            if t - due > LATE_S:
                return Ending.OVERRUN
            try:
                codes = self._hand.read_codes()
            except AeroError:
                missing += 1
                self.tally = replace(self.tally, missing=self.tally.missing + 1)
                if missing > MISSING_READINGS:
                    return Ending.READINGS
                due = max(due + period_s, self._clock.now())
                continue
            missing = 0
            lengths = self._map.lengths_from_codes(codes) - self._correction
            observation = history.observe(lengths)
            acting = _WALL.now()
            output = self._policy.network.act(observation).astype(np.float64)
            slow = _WALL.now() - acting > period_s
            action = self._interface.action.bounded(output)
            history.acted(action)
            target, asked, saturated = self.asked(action)
            asked, pending = (pending, asked) if self._settings.one_period_late else (asked, asked)
            command = slewed(self.command, asked, self._most)
            self._write(command)
            currents_a = self._currents(begun - 1)
            history.drew(currents_a)
            # A copy of `action`, because a callback may write into its step and the history keeps the array.
            step = Step(
                t=t,
                late_s=t - due,
                codes=codes,
                lengths=lengths,
                observation=observation,
                action=action.copy(),
                target=target,
                command=np.round(command).astype(np.uint16),
                saturated=saturated,
                limited=command != asked,
                currents_a=currents_a.copy(),
            )
            self._count(step, slow=slow, clipped=self._interface.action.cut_off(output))
            on_step(step)
            if self._blind > MISSING_READINGS:
                return Ending.READINGS
            due = max(due + period_s, t)
        self.tally = replace(self.tally, skipped=periods - begun)
        return Ending.TOO_SLOW if periods - begun > MOST_LATE * periods else Ending.TIME

    def asked(self, action: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Return target lengths of an action, their codes, and the mask of codes clipped to the window."""
        target = self._interface.action.target(action, self._map)
        angles = self._map.angles_from_travel(self._map.travel_from_lengths(target + self._correction))
        codes, saturated = self._map.saturating_codes(angles)
        return target, codes.astype(np.float64), saturated

    def _write(self, command: Floats) -> None:
        self.command = command
        if not self._settings.dry:
            self._hand.command_codes(np.round(command).astype(np.uint16))

    def _currents(self, period: int) -> Floats:
        """Read currents, and periodically temperatures; a missing reading returns NaN and is counted in `_blind`."""
        hottest = np.nan
        try:
            currents = self._hand.read_currents()
            if period % TEMPERATURES_EVERY == 0:
                hottest = float(np.max(self._hand.read_temperatures()))
        except AeroError:
            self._blind += 1
            return np.full(CHANNELS, np.nan)
        self._blind = 0
        self.tally = replace(self.tally, peak_temperature_c=float(np.fmax(self.tally.peak_temperature_c, hottest)))
        return currents

    def _count(self, step: Step, *, slow: bool, clipped: bool) -> None:
        peak = np.max(np.abs(step.currents_a), initial=0.0, where=np.isfinite(step.currents_a))
        self.tally = replace(
            self.tally,
            steps=self.tally.steps + 1,
            slow=self.tally.slow + slow,
            clipped=self.tally.clipped + clipped,
            saturated=self.tally.saturated + bool(step.saturated.any()),
            limited=self.tally.limited + bool(step.limited.any()),
            latest_s=max(self.tally.latest_s, step.late_s),
            peak_current_a=max(self.tally.peak_current_a, float(peak)),
        )
