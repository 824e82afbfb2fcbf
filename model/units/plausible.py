"""Plausible units: randomly drawn hands from the same parts, each identified by its seed."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from aero.channels import CABLES, FINGERS, Channel, Joint
from model.units import Unit, load_unit

PLAUSIBLE = "plausible:"
"""Prefix of a unit name that consists of a seed of the healthy population."""


@dataclass(frozen=True)
class Range:
    """Variation of one number around the reference unit, with its reason."""

    field: str
    """`section.field`; the entries of a list are drawn independently. Fields joined by `+` share the factor."""
    factor: float
    """Bound of a log-uniform factor, drawn between 1/factor and factor."""
    reason: str


RANGES = (
    Range("servos.stall_torque", 1.1, "vendor's tolerance of 10 % on torque"),
    Range("servos.duty_per_count", 1.05, "the same firmware in every servo; what is left is the supply"),
    Range("servos.no_load_speed_counts", 1.1, "vendor's tolerance of 10 % on speed"),
    Range("servos.goal_delay_s", 1.1, "servo loop period against bus cycle"),
    Range("hand.rotor_inertia", 1.15, "grease and gear train; motors are alike"),
    Range("hand.spool_friction", 2.0, "run-in of gears; the seven channels of one hand differ by as much"),
    Range(
        "hand.cable_friction", 1.15, "routing and wear of the sheaths; 0.43 to 0.61 on one hand, 0.37 to 0.70 in all"
    ),
    Range("hand.joint_friction", 2.0, "printed joints, with and without bushings"),
    Range("hand.joint_damping", 2.0, "silicone skin"),
    Range("hand.closed_stop", 1.01, "printed stops; the four fingers of one hand agree within 0.3 %"),
    Range("hand.winding_scale", 1.02, "one winding layer more or less of 0.2 mm on a 9 mm spool"),
    Range("hand.cable_compliance", 1.5, "new against stretched cable"),
    Range("hand.supply_ratio", 1.1, "bench supply against battery"),
    Range("hand.supply_sag", 2.0, "length and section of the wires; assumed"),
    Range("hand.cable_friction_spread", 1.5, "assumed"),
    Range(
        "servos.case_c_per_a2+servos.case_c_per_count_per_s",
        1.2,
        "air and mounting of the case; the maker's times at one torque differ by 1.5, which is a factor of 1.2",
    ),
    Range(
        "servos.motor_c_per_a+servos.motor_c_per_a2",
        1.2,
        "fitted one by one, the servos of one hand differ by as much",
    ),
    Range("servos.motor_c_per_count_per_s", 1.2, "the same"),
)
"""Numbers multiplied by random factors."""
PADS = (
    Range("hand.pad_friction", 1.43, "0.5 to 1.0, the paper's randomisation of the fingertips"),
    Range("hand.pad_patch", 1.2, "2.2 to 3.2 mm: silicone of Shore A 30 to 10 (assumed)"),
    Range("hand.pad_loss", 1.7, "0.18 to 0.5: share of energy that silicone loses (assumed)"),
    Range("hand.pad_compliance", 2.4, "0.1 to 0.6 mm/N: hard and thin to soft and thick pads (assumed)"),
)
"""The same for the silicone pads; drawn from a random stream of their own."""
PAD_STREAM = 1
TAKE_UP_M = (-2.5e-4, 0.0, 2.3e-3)
"""Lowest, median and highest cable take-up of a finger, m. Half of the fingers are taut, as on the recorded hand; the
others are within one tooth of the servo's 25-tooth spline, 14.4°. The thumb's CMC and flexor cables vary equally around
the recorded thumb's values. The 7.6 mm measured by one owner on an index finger count as a fault, because turning the
spool by three teeth would remove them."""
ACCELERATION_UNIT_COUNTS = (64.0, 100.0)
"""Range of the unit of the acceleration register, counts/s²: from the paper's rise times to the vendor's value."""
CMC_STOP_RAD = (0.88, 0.97)
"""Range of the closed stop of CMC flexion, rad. Homing refers the command window to this stop, so the palm blocks the
unabducted thumb at 55 to 61 % of 0.2.0's window (60.5 % on the recorded hand)."""
THENAR_M = (3e-3, 4.1e-3)
"""Range of the radius of the palm's contact with the thumb, m: from no contact before the stop to just above the
recorded hand's."""
START_C = (27.0, 51.0)
"""Range of the initial servo temperature, °C. Source: recordings of one hand."""
FINGER_SPRING_FACTOR = 1.3
"""Bound of the common factor on a finger's spring torques. Source: differences between the fingers of one hand."""


def unit_named(name: str) -> Unit:
    """Return a unit by name: a shipped one, `PATH.toml`, or `plausible:SEED` for a random healthy hand.

    Raises:
        ValueError: unknown unit, invalid file, or a seed that is not a non-negative integer.
    """
    if not name.startswith(PLAUSIBLE):
        return load_unit(name)
    seed = name.removeprefix(PLAUSIBLE)
    if not seed.isdecimal():
        raise ValueError(f"unit {name!r}: write {PLAUSIBLE}SEED with a whole number from 0 on")
    return plausible_unit(int(seed))


def _multiply(tables: dict[str, dict[str, Any]], span: Range, stream: np.random.Generator) -> None:
    """Multiply the fields of a range by factors drawn from `stream`."""
    names = [name.split(".") for name in span.field.split("+")]
    width, (section, field) = math.log(span.factor), names[0]
    factors = np.exp(stream.uniform(-width, width, np.shape(tables[section][field])))
    for section, field in names:
        value = tables[section][field]
        drawn = np.multiply(value, factors)
        tables[section][field] = tuple(drawn.tolist()) if isinstance(value, tuple) else float(drawn)


def plausible_unit(seed: int) -> Unit:
    """Return the unit drawn around the reference unit with a seed."""
    draw = np.random.default_rng(seed)
    unit = load_unit("reference")
    tables = {"servos": dataclasses.asdict(unit.servos), "hand": dataclasses.asdict(unit.hand)}
    for stream, spans in ((draw, RANGES), (np.random.default_rng([seed, PAD_STREAM]), PADS)):
        for span in spans:
            _multiply(tables, span, stream)
    mechanics = tables["hand"]
    loads = np.ones(16)
    width = math.log(FINGER_SPRING_FACTOR)
    loads[:12] = np.repeat(np.exp(draw.uniform(-width, width, 4)), 3)
    for field in ("spring_open", "spring_closed"):
        mechanics[field] = tuple(np.multiply(mechanics[field], loads).tolist())
    take_up = np.array(mechanics["cable_take_up"])
    lengths = np.interp(draw.uniform(0.0, 1.0, len(CABLES)), (0.0, 0.5, 1.0), TAKE_UP_M)
    take_up[list(FINGERS)] = lengths[:4]
    take_up[[Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR]] += lengths[4:]
    mechanics["cable_take_up"] = tuple(take_up.tolist())
    stops = np.array(mechanics["closed_stop"])
    stops[Joint.THUMB_CMC] = draw.uniform(*CMC_STOP_RAD)
    mechanics["closed_stop"] = tuple(stops.tolist())
    mechanics["thenar_radius"] = float(draw.uniform(*THENAR_M))
    tables["servos"]["acceleration_unit_counts"] = float(draw.uniform(*ACCELERATION_UNIT_COUNTS))
    tables["servos"]["start_temperature_c"] = float(draw.uniform(*START_C))
    return dataclasses.replace(
        unit,
        name=f"{PLAUSIBLE}{seed}",
        description=f"Drawn around the reference unit with seed {seed}",
        hand=dataclasses.replace(unit.hand, **mechanics),
        servos=dataclasses.replace(unit.servos, **tables["servos"]),
    )
