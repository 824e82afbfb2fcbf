"""Simulated person who watches an emulated hand and notices 5 degrees at a digit.

With three joints, 5 degrees in all displace the fingertip by half a centimetre.
"""

import numpy as np

from aero.channels import FINGERS, Channel
from hil.checks.look.check import AGAIN, NO, NONE, STRAIGHT, YES, digit

SEEN_DEG = 5.0
JOINTS = {finger: slice(3 * finger, 3 * finger + 3) for finger in FINGERS} | {
    Channel.THUMB_ABDUCTION: slice(12, 13),
    Channel.THUMB_CMC_FLEXION: slice(13, 14),
    Channel.THUMB_FLEXOR: slice(14, 16),
}


class Person:
    """Watches `progress`, and answers from the observed joints."""

    def __init__(self, *, again=0, leaves_after=None):
        self.plant = None
        self.asked = []
        self._seen = []
        self._again, self._leaves_after = again, leaves_after

    def watch(self, _done, doing):
        """Observe the hand at each sample of an experiment's progress."""
        self._seen.append((doing, np.rad2deg(self.plant.joint_angles())))

    def answer(self, question):
        self.asked.append(question.text)
        if self._leaves_after is not None and len(self.asked) > self._leaves_after:
            raise KeyboardInterrupt
        seen = np.array([angles for doing, angles in self._seen if not question.motion or doing == question.motion])
        now = self._seen[-1][1]
        self._seen.clear() if question.motion else None
        if question.motion and self._again:
            self._again -= 1
            return AGAIN
        if "every finger" in question.text:
            return YES if all(self._bend(now, channel) < SEEN_DEG for channel in STRAIGHT) else NO
        if question.text.startswith("Is the"):
            [channel] = [c for c in STRAIGHT if digit(c) in question.text]
            return YES if self._bend(now, channel) < SEEN_DEG else NO
        moved = {channel: np.ptp([self._bend(angles, channel) for angles in seen]) for channel in Channel}
        most = max(moved, key=moved.get)
        if NONE in [option.answer for option in question.options]:
            return most.label if moved[most] > SEEN_DEG else NONE
        return YES if moved[most] > SEEN_DEG else NO

    @staticmethod
    def _bend(angles, channel):
        return float(angles[JOINTS[channel]].sum())
