"""The hand of a report: its digits drawn from the model's geometry, each part coloured by its channel's verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel, Joint
from hil.verdict.diagnosis import Component
from hil.verdict.judged_run import Validation
from model import geometry
from model.geometry.elements import Link
from model.routed import build_routed

DigitState = Literal["pass", "fail", "partly", "none"]
WORDS: dict[DigitState, str] = {
    "pass": "all checks passed",
    "fail": "checks failed",
    "partly": "passed until the run was aborted",
    "none": "not judged",
}
MARKS: dict[DigitState, str] = {"pass": "\u2713", "fail": "\u2717", "partly": "\u25d0", "none": "\u2013"}
"""Beside each name, so that no verdict is shown by colour alone."""
BLAMED = {None, Component.CHANNEL, Component.CHANNELS, Component.HAND, Component.UNKNOWN}
"""Components, or none, with which a failed check of a channel is about that channel."""

POSE = {Joint.THUMB_ABDUCTION: 0.9, Joint.THUMB_CMC: 0.25}
"""Joints that are not extended in the picture, rad: the thumb stands beside the palm."""
WIDEST = 0.008
"""Half the width of a part at most, m: the thumb's base is a block across the thumb."""
LABEL_STEP = 11.0
"""From one name beside the thumb to the next, mm."""


@dataclass(frozen=True)
class Digit:
    """What a channel moves: the parts between its joints, as drawn."""

    points: tuple[tuple[float, float], ...]
    """Joints and tip, mm, right and down in the picture."""
    width: float
    """mm"""

    @property
    def path(self) -> str:
        """The `d` of an SVG path."""
        return "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in self.points)

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of its first part, mm: where a line to its name begins."""
        (x0, y0), (x1, y1) = self.points[:2]
        return (x0 + x1) / 2, (y0 + y1) / 2


@dataclass(frozen=True)
class Outline:
    """A hand as it is drawn."""

    palm: str
    """The `d` of the palm's path."""
    digits: Mapping[Channel, Digit]
    box: tuple[float, float, float, float]
    """Left, top, width and height, mm."""


@dataclass(frozen=True)
class ChannelVerdict:
    """What a run says about one channel."""

    state: DigitState
    words: str
    """For people."""
    reason: str = ""
    """Why it was not judged; empty for one that was."""


def verdicts(validation: Validation) -> dict[Channel, ChannelVerdict]:
    """Return each channel's verdict: grey where its checks say nothing about it, or where there are none.

    A driver, a link or a supply that is at fault makes checks of healthy fingers fail.
    """
    return {channel: _verdict(validation, channel) for channel in Channel}


def _verdict(validation: Validation, channel: Channel) -> ChannelVerdict:
    location = validation.diagnosis.location
    passed = [finding.passed for finding in validation.findings if finding.subject == channel.label]
    if not passed:
        return ChannelVerdict("none", WORDS["none"], "no check of the channel was run")
    if not all(passed):
        words = f"{passed.count(False)} of {len(passed)} checks failed"
        elsewhere = location is not None and location.channels and channel not in location.channels
        if location is not None and (
            location.component not in BLAMED or (elsewhere and not _unexplained(validation, channel))
        ):
            return ChannelVerdict("none", words, f"what failed comes from the {location.words}")
        return ChannelVerdict("fail", words)
    state: DigitState = "pass" if validation.end.finding is None else "partly"
    return ChannelVerdict(state, f"{WORDS[state]} ({len(passed)})")


def _unexplained(validation: Validation, channel: Channel) -> bool:
    return any(finding.subject == channel.label for finding in validation.diagnosis.unexplained)


@cache
def outline(side: geometry.Side) -> Outline:
    """Return the palm side of a hand, fingers up, seen from where the palm looks to."""
    model = build_routed(side).compile()
    data = mujoco.MjData(model)
    for joint, angle in POSE.items():
        data.joint(joint.label).qpos = angle
    mujoco.mj_forward(model, data)
    base = geometry.hand(side).base

    def seen(link: Link, point: tuple[float, float, float]) -> tuple[float, float]:
        body = data.body(link.name)
        x, y, _ = body.xpos + body.xmat.reshape(3, 3) @ np.array(point)
        return -1e3 * float(y), -1e3 * float(x)

    digits: dict[Channel, Digit] = {}
    for link in base.walk():
        if link.hinge is None:
            continue
        tips = [guide.pos for guide in link.guides if guide.name.endswith("_tip")]
        ends = [seen(child, (0.0, 0.0, 0.0)) for child in link.links] or [seen(link, tips[0])]
        channel = channel_of(link.hinge.joint)
        before = digits[channel].points if channel in digits else (seen(link, (0.0, 0.0, 0.0)),)
        across = 2e3 * min(link.boxes[0].half[0], WIDEST)
        width = max(digits[channel].width, across) if channel in digits else across
        digits[channel] = Digit((*before, ends[0]), width)
    palm = next(link for link in base.walk() if link.name == "palm")
    corners = [seen(palm, corner) for box in palm.boxes for corner in _corners(box.half, box.pos, box.quat)]
    points = np.vstack([corners, *(np.array(digit.points) for digit in digits.values())])
    (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
    path = "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in convex_hull(corners)) + "Z"
    return Outline(path, digits, (left, top, right - left, bottom - top))


def convex_hull(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the corners of the convex hull of at least three points, counter-clockwise; Andrew's monotone chain.

    SciPy has one, and takes half a second to be imported.
    """
    ordered = sorted(set(points))

    def chain(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
        found: list[tuple[float, float]] = []
        for x, y in points:
            while len(found) > 1:
                (x0, y0), (x1, y1) = found[-2:]
                if (x1 - x0) * (y - y0) > (y1 - y0) * (x - x0):
                    break
                found.pop()
            found.append((x, y))
        return found[:-1]

    return chain(ordered) + chain(reversed(ordered))


def thumb_heights(side: geometry.Side) -> dict[Channel, float]:
    """Return how far down the name of each channel of the thumb stands in the picture, mm."""
    digits = outline(side).digits
    lowest = digits[Channel.THUMB_ABDUCTION].middle[1] + LABEL_STEP
    names = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
    return {channel: lowest - LABEL_STEP * row for row, channel in enumerate(names)}


def channel_of(joint: Joint) -> Channel:
    """Return the channel that moves a joint."""
    name = joint.label
    if not name.startswith("thumb"):
        return Channel[name.partition("_")[0].upper()]
    thumb = {Joint.THUMB_ABDUCTION: Channel.THUMB_ABDUCTION, Joint.THUMB_CMC: Channel.THUMB_CMC_FLEXION}
    return thumb.get(joint, Channel.THUMB_FLEXOR)


def _corners(
    half: tuple[float, ...], centre: tuple[float, ...], quat: tuple[float, ...]
) -> list[tuple[float, float, float]]:
    """Return the eight corners of a box, m, in its link's frame."""
    turn: NDArray[np.float64] = np.empty(9)
    mujoco.mju_quat2Mat(turn, np.array(quat))
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    found = np.array(centre) + (signs * np.array(half)) @ turn.reshape(3, 3).T
    return [(float(x), float(y), float(z)) for x, y, z in found]
