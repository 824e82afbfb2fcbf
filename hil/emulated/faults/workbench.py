"""User's acts on a running emulated hand: inject and clear faults, exchange and replace parts, touch, inspect.

A `Workbench` stores the faults of a hand. Acts take effect at once, in the thread that moves the hand.
"""

import logging
from dataclasses import replace
from math import inf
from typing import Any

from aero.channels import Channel
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.homing import home
from firmware_emulator.hand import EmulatedHand
from hil.emulated.faults.assembly import Active, HandAssembly
from hil.emulated.faults.fault import AssemblyStage, FaultLayer, Injection
from hil.emulated.faults.host import refuse_at_a_port
from hil.emulated.faults.inspection import cables_of, felt_of_digit, in_words, odd_on_bus, seen_of_cable
from hil.emulated.faults.mechanics import JOINTS, unloaded, with_values
from hil.emulated.faults.schedule import Schedule, refuse_rivals
from hil.emulated.faults.servo import servo_of
from hil.verdict.part import Part
from model import BuiltHandPlant
from model.units import Unit

_LOG = logging.getLogger(__name__)
FIRES_ITSELF = (FaultLayer.BUS, FaultLayer.LINK, FaultLayer.HOST)
"""Layers whose faults fire only on passing bytes."""
TOUCHING = (FaultLayer.CABLE, FaultLayer.JOINT)
"""Layers whose set-up faults are objects in contact with the hand."""
FLASHED = (FaultLayer.FIRMWARE, FaultLayer.BOARD)
"""Layers whose faults flashing clears."""
BEFORE_THE_BOARD = (Part.COMPUTER, Part.DRIVER, Part.USB)
"""Parts that are replaced without a power cycle of the hand."""
OF_A_SERVO = ("rotor_inertia", "spool_damping", "spool_friction")
"""Mechanics fields that move with a servo to another channel."""
EXCHANGES = {Part.SERVO: "exchange_servos", Part.BUS: "exchange_plugs"}
EMPTIED = "took everything out of the hand"
HELD_SHARE = 0.55
"""Travel of a joint up to a held object, fraction of full travel."""


class Workbench:
    """Emulated hand with its faults and the acts on it."""

    def __init__(self, assembly: HandAssembly, schedule: Schedule) -> None:
        """Prepare for the faults of a schedule; nothing is injected yet."""
        self.assembly = assembly
        self.done: list[tuple[float, str]] = []
        """Log of acts: time, s on the hand's clock, and text."""
        self.at_a_port = False
        """True if the hand serves a port; host faults are then refused."""
        self.schedule = schedule
        """Faults, with their firing state."""
        self._present: dict[Injection, Active] = {}
        self._cables_off: dict[Channel, tuple[Active, list[Injection]]] = {}
        self._held: Active | None = None
        self._powered = self._supplied = True
        self._aside: tuple[Injection, ...] = ()
        self._exchanged: list[tuple[Part, Channel, Channel]] = []

    @property
    def mechanics(self) -> BuiltHandPlant:
        """Mechanics behind the servos."""
        return self.assembly.mechanics

    @property
    def electronics(self) -> EmulatedHand:
        """Electronics of the hand."""
        return self.assembly.electronics

    @property
    def present(self) -> tuple[Injection, ...]:
        """Injected faults, those before their start time included."""
        return tuple(self._present)

    @property
    def acts_present(self) -> tuple[str, ...]:
        """Acts that bring a healthy hand into the present state."""
        return (
            *(f"{EXCHANGES[part]} {one.label} {other.label}" for part, one, other in self._exchanged),
            *(f"cable_off {channel.label}" for channel in self._cables_off),
            *["hold"] * (self._held is not None),
            # Momentary faults, such as a restart, leave no state to be restored.
            *(f"inject {fault}" for fault, active in self._present.items() if active.clear is not None),
            *["supply_off"] * (not self._supplied),
            *["power_off"] * (not self._powered),
        )

    def build(self, stage: AssemblyStage) -> None:
        """Inject the faults of one stage of the assembly, in the order of the schedule."""
        faults = [fault for fault in self.schedule.faults if fault.fault.layer.stage is stage]
        for fault in faults:
            self._present[fault] = fault.fault.inject(self.assembly, fault)
        for fault in faults:
            if not fault.at_s:
                self._begin(fault)

    def start(self) -> None:
        """Schedule the faults with a start time, counted from now."""
        kernel = self.electronics.kernel
        for fault in self.schedule.faults:
            if fault.at_s:
                kernel.call_at(kernel.now + fault.at_s, self._begin, fault)

    def _begin(self, fault: Injection) -> None:
        if (active := self._present.get(fault)) is None:
            return  # cleared before its start time
        active.begin()
        if fault.fault.layer not in FIRES_ITSELF:
            self.schedule.fire(fault)

    def inject(self, fault: Injection) -> None:
        """Inject a fault now, regardless of its start time.

        Raises:
            ValueError: the fault is built in, already present, excluded by another fault, or refused by this hand.
        """
        if not fault.fault.later:
            raise ValueError(f"{fault.name} is built in and cannot begin on a running hand; give it at the opening")
        refuse_rivals((*self._present, fault))
        if self.at_a_port:
            refuse_at_a_port((fault,))
        self._put(fault)
        self._note(f"injected {fault}")

    def clear(self, fault: Injection) -> None:
        """Clear a fault and restore the state before it.

        Raises:
            ValueError: the hand does not have the fault, or the fault cannot be undone.
        """
        found = next((one for one in self._present if (one.fault, one.channel) == (fault.fault, fault.channel)), None)
        if found is None:
            raise ValueError(f"the hand does not have {fault.name}; it has {self.words() or 'no fault'}")
        if self._present[found].clear is None:
            raise ValueError(f"{fault.name} has happened and cannot be undone")
        self._take(found)
        self._note(f"cleared {found}")

    def words(self) -> str:
        """Return the faults of the hand as `parse_fault` reads them, separated by blanks."""
        return " ".join(map(str, self._present))

    def exchange_servos(self, one: Channel, other: Channel) -> str:
        """Exchange two servos and set their IDs: servo faults move along, digit faults stay."""
        self._exchange(Part.SERVO, one, other)
        self.electronics.reset("power_on")
        return self._note(f"exchanged the servos of {one.label} and {other.label}, and set their IDs; home the hand")

    def exchange_plugs(self, one: Channel, other: Channel) -> str:
        """Exchange the bus plugs of two servos: faults of a plug or its wire move along."""
        self._exchange(Part.BUS, one, other)
        self.electronics.reset("power_on")
        return self._note(f"exchanged the bus plugs of {one.label} and {other.label}")

    def _exchange(self, part: Part, one: Channel, other: Channel) -> None:
        def exchanged(unit: Unit) -> Unit:
            for field in OF_A_SERVO:
                values = list(getattr(unit.hand, field))
                values[one], values[other] = values[other], values[one]
                changed: dict[str, Any] = {field: tuple(values)}
                unit = replace(unit, hand=replace(unit.hand, **changed))
            return unit

        if part is Part.SERVO:  # before the faults move, some of which heat a servo
            servo_of(self.electronics, one).exchange_heat(servo_of(self.electronics, other))
        self._move(part, {one: other, other: one})
        if part is Part.SERVO:
            self.assembly.refound(exchanged)
        if self._exchanged and self._exchanged[-1] in ((part, one, other), (part, other, one)):
            self._exchanged.pop()
        else:
            self._exchanged.append((part, one, other))

    def cable_off(self, channel: Channel) -> str:
        """Unload a servo: detach the cable from its spool, or the abduction linkage from its horn.

        Raises:
            ValueError: the cable is already off.
        """
        if channel in self._cables_off:
            raise ValueError(f"the cable of {channel.label} is off its spool")
        # A winding fault must not act on a servo without a cable.
        wound = [
            fault for fault in self._present if fault.fault.layer is FaultLayer.WINDING and channel in cables_of(fault)
        ]
        for fault in wound:
            self._take(fault)
        active = self.assembly.changed(lambda unit: unloaded(unit, channel))
        active.begin()
        self._cables_off[channel] = active, wound
        return self._note(f"took the cable of {channel.label} off its spool")

    def cable_on(self, channel: Channel) -> str:
        """Reattach a cable and restore its winding faults.

        Raises:
            ValueError: the cable is already on.
        """
        if channel not in self._cables_off:
            raise ValueError(f"the cable of {channel.label} is on its spool")
        active, wound = self._cables_off.pop(channel)
        active.undo()
        for fault in wound:
            self._put(fault)
        return self._note(f"put the cable of {channel.label} on its spool")

    def hold(self) -> str:
        """Place an object in the hand, which stops the digits early.

        Raises:
            ValueError: the hand already holds an object.
        """
        if self._held is not None:
            raise ValueError("the hand holds something")
        joints = [joint for channel in Channel for joint in JOINTS[channel] if channel is not Channel.THUMB_ABDUCTION]
        self._held = self.assembly.changed(
            lambda unit: with_values(unit, "closed_stop", joints, lambda stop: HELD_SHARE * stop)
        )
        self._held.begin()
        return self._note("put something into the hand")

    def let_go(self) -> str:
        """Remove a held object or a glove, and separate digits in contact."""
        touching = [one for one in self._present if one.part is Part.SETUP and one.fault.layer in TOUCHING]
        for fault in touching:
            self._take(fault)
        there = bool(touching) or self._held is not None
        if self._held is not None:
            self._held.undo()
            self._held = None
        return self._note(EMPTIED if there else "there was nothing to take out of the hand")

    def home(self) -> str:
        """Start homing on the board, which takes some seconds.

        Raises:
            ValueError: the board runs a firmware program; only its own driver can home it.
        """
        board = self.electronics.board
        if not isinstance(board, Board):
            raise ValueError("a firmware program is homed by a driver")
        board.start(home(board))
        return self._note("homing")

    def power_off(self) -> str:
        """Switch off board and servos."""
        self._powered = False
        self.electronics.board.stop()
        for servo in self.electronics.servos:
            servo.write(servo.model.places["torque_enable"].address, b"\0")
        return self._note("switched off")

    def power_on(self) -> str:
        """Switch on board and servos; the restart takes some seconds."""
        self._powered = True
        self._supply()
        self.electronics.reset("power_on")
        return self._note("switched on")

    def supply_off(self) -> str:
        """Switch off the servos' supply; the board runs on over USB and hears no servo."""
        self._supplied = False
        for servo in self.electronics.servos:
            servo.power_up()  # without torque, goals and counted turns
            servo.silent_until = inf
        return self._note("switched the servos' supply off; the board runs on over USB")

    def supply_on(self) -> str:
        """Switch on the servos' supply; the board does not restart, so nothing homes."""
        self._supply()
        return self._note("switched the servos' supply on; the board did not restart, so nothing homes")

    def _supply(self) -> None:
        if not self._supplied:
            self._supplied = True
            for servo in self.electronics.servos:
                servo.power_up()
                servo.silent_until = self.electronics.kernel.now

    def replace(self, part: Part, channel: Channel | None = None) -> str:
        """Replace a part, or correct the set-up, and clear its faults.

        Args:
            part: part to be replaced.
            channel: channel of the servo, digit or plug; every channel if None.
        """
        for fault in list(self._present):
            # A replacement board has the declared firmware.
            flashed = part is Part.BOARD and fault.fault.layer is FaultLayer.FIRMWARE
            if flashed or (fault.part is part and channel in (None, fault.channel)):
                self._take(fault)
        if part is Part.SETUP:
            self.let_go()
        if part not in BEFORE_THE_BOARD:
            self.electronics.reset("power_on")
        return self._note(f"replaced: {part.value}{'' if channel is None else f' of {channel.label}'}")

    def feel(self, channel: Channel) -> str:
        """Bend a digit by hand, supply off, and log the differences from the healthy hand."""
        return self._note(in_words(f"bent {channel.label}", self.felt(channel)))

    def felt(self, channel: Channel) -> tuple[str, ...]:
        """Return the differences from the healthy hand that are felt when a digit is bent."""
        return felt_of_digit(self.assembly, channel)

    def look(self, channel: Channel) -> str:
        """Inspect a cable visually and log the differences from the healthy hand."""
        return self._note(in_words(f"looked at {channel.label}", self.seen(channel)))

    def seen(self, channel: Channel) -> tuple[str, ...]:
        """Return the differences from the healthy hand that are seen along a cable."""
        wound = [c for one in self._present if one.fault.layer is FaultLayer.WINDING for c in cables_of(one)]
        return seen_of_cable(self.assembly, wound, channel)

    def registers(self) -> str:
        """Read the servos on a bus adapter and log the IDs that do not answer or answer twice."""
        return self._note(in_words("read the bus", self.on_bus()))

    def on_bus(self) -> tuple[str, ...]:
        """Return the IDs that do not answer a bus adapter, or answer twice, as sentences."""
        return odd_on_bus(self.assembly)

    def flashed(self) -> str:
        """Log the firmware version and side on the board."""
        return self._note(f"flashed: {self.assembly.firmware}, for a {self.assembly.board_side} hand")

    def flash(self) -> str:
        """Flash the declared firmware: clears faults of the board's program, keeps those of its hardware."""
        for fault in [one for one in self._present if one.fault.layer in FLASHED]:
            self._take(fault)
        self.electronics.reset("power_on")
        return self._note("flashed the board")

    def set_aside(self, *parts: Part) -> None:
        """Clear the faults of some parts for a time; `put_back` restores them."""
        self._aside = tuple(one for one in self._present if one.part in parts)
        for fault in self._aside:
            self._take(fault)

    def put_back(self) -> None:
        """Restore the faults that `set_aside` cleared."""
        for fault in self._aside:
            self._put(fault)
        self._aside = ()

    def voltage(self) -> str:
        """Measure the supply at the board's plug."""
        return self._note(f"measured {self.volts():.2f} V at the plug; the supply gives {self.usual_volts:.2f} V")

    @property
    def usual_volts(self) -> float:
        """Voltage of the healthy supply, V."""
        healthy = self.assembly.healthy
        return healthy.servos.voltage * healthy.hand.supply_ratio

    def volts(self) -> float:
        """Return the present supply voltage, V; 0 if switched off."""
        return self.assembly.healthy.servos.voltage * self.assembly.supply_left() * self._on

    @property
    def _on(self) -> bool:
        return self._powered and self._supplied

    def _put(self, fault: Injection) -> None:
        active = fault.fault.inject(self.assembly, fault)
        self._present[fault] = active
        active.begin()

    def _take(self, fault: Injection) -> None:
        self._present.pop(fault).undo()

    def _move(self, part: Part, swap: dict[Channel, Channel]) -> None:
        """Move the faults of a part to another channel; clear those that cannot occur on that channel."""
        moved = [fault for fault in self._present if fault.part is part and fault.channel in swap]
        for fault in moved:
            self._take(fault)
        for fault in moved:
            there = swap[fault.where]
            # ID faults do not move, because an exchange sets the IDs.
            if there in fault.fault.channels and fault.fault.excludes != "id":
                self._put(replace(fault, channel=there))

    def _note(self, text: str) -> str:
        self.done.append((self.electronics.kernel.now, text))
        _LOG.info("%s", text)
        return text
