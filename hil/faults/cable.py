"""Faults of cables and their spools."""

from __future__ import annotations

from dataclasses import replace

from aero.channels import CABLES, Channel
from hil.faults.fault import Fault, FaultLayer, Injection, Severity
from hil.faults.part import Part
from hil.faults.unit_change import UnitChange, another_unit, on_channel, with_values
from model.units import Unit

THUMB_CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
NEVER_TAUT_M = 0.9
"""Take-up of a cable that is off: 100 rad of spool."""


def _soft(unit: Unit, fault: Injection) -> Unit:
    return replace(unit, hand=replace(unit.hand, cable_compliance=unit.hand.cable_compliance + fault.severity * 1e-6))


def _derailed(unit: Unit, fault: Injection) -> Unit:
    which = THUMB_CABLES.index(fault.where)
    return with_values(unit, "abduction_winding", [which], lambda value: value + fault.severity * 1e-3)


def _fault(
    name: str,
    words: str,
    change: UnitChange,
    severity: Severity | None,
    channels: tuple[Channel, ...] = CABLES,
    *,
    part: Part = Part.DIGIT,
) -> Fault:
    return Fault(name, FaultLayer.CABLE, part, words, another_unit(change), channels, severity)


FAULTS = (
    _fault(
        "cable_friction",
        "a cable rubs in its sheath",
        on_channel("cable_friction", lambda value, severity: value + severity),
        Severity("of tension", (0.15, 0.4, 0.8)),
    ),
    _fault(
        "cable_long",
        "a cable is slack at the open hand",
        on_channel("cable_take_up", lambda value, severity: value + severity * 1e-3),
        Severity("mm", (3, 7.6, 20)),
    ),
    _fault(
        "cable_short",
        "a cable is too short and holds the digit bent",
        on_channel("cable_take_up", lambda value, severity: value - severity * 1e-3),
        Severity("mm", (3, 7, 12)),
    ),
    # All cables of one material: no digit is to be mended alone.
    _fault("cable_soft", "the cables stretch", _soft, Severity("µm/N", (15, 60, 200)), (), part=Part.SETUP),
    _fault(
        "cable_snapped",
        "a cable is torn or off its spool",
        on_channel("cable_take_up", lambda value, severity: NEVER_TAUT_M),
        None,
    ),
    _fault(
        "spool_wrong",
        "a spool is small for its cable",
        on_channel("winding_scale", lambda value, severity: value * severity),
        Severity("factor", (1.04, 1.1, 1.3), 0.5, 2),
    ),
    _fault(
        "thumb_derailed",
        "a thumb cable runs beside its guide",
        _derailed,
        Severity("mm/rad", (1.5, 4, 8)),
        THUMB_CABLES,
    ),
)
