"""Manual acts on an emulated hand: bend a digit, turn a spool, unload a servo."""

import math
from collections.abc import Callable

import numpy as np

from aero.channels import CABLES, Channel
from hil.emulated.faults.assembly import HandAssembly
from hil.emulated.faults.mechanics import JOINTS, NEVER_TAUT_M, with_values
from hil.emulated.faults.servo import servo_of
from model.units import Unit

TOUCH_S = 2.0
"""Duration of bending a digit or turning a spool by hand, s."""
PUSH_NM = 0.12
"""Torque of a push at each joint of a digit, N m."""
PLAY_MM, OFF_MM = 1.0, 50.0
"""Thresholds of cable play, mm: above the first it is felt, above the second the cable is off its spool."""
TURN_RAD, TURN_NM, TURN_GAIN, TURN_DAMPING = math.pi, 0.6, 2.0, 0.02
"""Turn of a spool by hand: angle, rad; torque limit, N m; gains, N m/rad and N m s/rad."""
LOOK_S = 0.01
"""Control period of turning a spool by hand, s."""
Tell = Callable[[str], object]
"""Receives the finding as a sentence."""


def bend(assembly: HandAssembly, channel: Channel, tell: Tell) -> None:
    """Start to push a digit closed, then open; `tell` receives its travel and the state of its cable at the end."""
    joints, mechanics, kernel = list(JOINTS[channel]), assembly.mechanics, assembly.electronics.kernel
    start = mechanics.joint_angles()[joints]
    reached: list[float] = []

    def push(sign: float) -> None:
        assembly.advance()
        angles = mechanics.joint_angles()
        reached.append(float(np.abs(angles[joints] - start).max()))
        torques = np.zeros(angles.size)
        torques[joints] = sign * PUSH_NM
        mechanics.push(torques)

    def let_go() -> None:
        push(0.0)
        tell(
            f"bent {channel.label} by hand; {cable_words(assembly, channel)}; it moved by "
            f"{math.degrees(max(reached)):.0f} deg"
        )

    push(1.0)
    kernel.call_at(kernel.now + 0.5 * TOUCH_S, push, -1.0)
    kernel.call_at(kernel.now + TOUCH_S, let_go)


def cable_words(assembly: HandAssembly, channel: Channel) -> str:
    """Return the cable state of a digit at rest (taut, play in mm, free, none), as text for display."""
    if channel not in CABLES:
        return "it has no cable"
    loose_mm = 1e3 * float(assembly.mechanics.slack()[channel])
    if loose_mm > OFF_MM:
        return "its cable hangs free"
    return "its cable is taut" if loose_mm < PLAY_MM else f"its cable has {loose_mm:.0f} mm of play"


def turn(assembly: HandAssembly, channel: Channel, tell: Tell) -> None:
    """Start to turn a spool in the closing direction with servo torque off; `tell` receives the angle at the end."""
    servo, mechanics, kernel = servo_of(assembly.electronics, channel), assembly.mechanics, assembly.electronics.kernel
    servo.write(servo.model.places["torque_enable"].address, b"\0")
    start, begun = float(mechanics.angles()[channel]), kernel.now

    def follow() -> None:
        assembly.advance()
        turned = float(mechanics.angles()[channel]) - start
        part = (kernel.now - begun) / TOUCH_S
        if part >= 1.0:
            mechanics.twist(channel, 0.0)
            tell(f"turned the spool of {channel.label} by hand by {math.degrees(turned):.0f} deg")
            return
        wanted = TURN_GAIN * (TURN_RAD * part - turned) - TURN_DAMPING * float(mechanics.speeds()[channel])
        mechanics.twist(channel, min(max(wanted, -TURN_NM), TURN_NM))
        kernel.call_at(kernel.now + LOOK_S, follow)

    follow()


def unloaded(unit: Unit, channel: Channel) -> Unit:
    """Return a unit with the servo of `channel` unloaded."""
    if channel in CABLES:
        return with_values(unit, "cable_take_up", [channel], lambda _: NEVER_TAUT_M)
    # Abduction has no cable: its shaft is the joint, so the joint's own torques and stop are removed instead.
    nothing: dict[str, Callable[[float], float]] = {
        "joint_friction": lambda _: 0.0,
        "spring_open": lambda _: 0.0,
        "spring_closed": lambda _: 0.0,
        "closed_stop": lambda stop: stop + math.pi,
    }
    for field, value in nothing.items():
        unit = with_values(unit, field, JOINTS[channel], value)
    return unit
