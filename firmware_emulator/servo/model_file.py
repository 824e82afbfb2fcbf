"""Bus servo models as data, one TOML file per model: registers and other differences between models.

A file contains `name`, `number`, the encodings, `[sources]` (one letter each), and one row per register: name, address,
size, access (`r` or `rw`), lowest, highest and factory value, sign bit (0 for none), unit, source. `like = "OTHER"`
inherits another model; rows and settings of the file override inherited ones, `without` removes registers.

Missing registers read as zeros on the bus. Inside the servo, `[instead]` replaces a missing register by another
register's name or by a constant.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args

from msgspec import Meta

from aero_hil_toml import filled, parsed
from firmware_emulator.packets import Instruction

MEMORY_SIZE = 128
EEPROM_END = 40
FEEDBACK = 56
"""First address of the measurements; up to 66 they are equal in all series."""
FEEDBACK_SIZE = 15
"""Length of the measurement block read by the hand's firmware, bytes."""
Mode = Literal["position", "speed", "current", "pwm", "step"]
MODES = get_args(Mode)
"""Operating modes of the mode register; `step` is not modelled and acts as `position`."""


class Register(NamedTuple):
    """One row of the map."""

    name: str
    """Lower-case name."""
    address: int
    size: int
    """Bytes, 1 or 2."""
    writable: bool
    """Whether bus writes have an effect; writes to read-only registers are acknowledged and ignored."""
    low: int
    """Smallest value (magnitude for signed registers); smaller ones are clipped."""
    high: int
    """Largest value (magnitude for signed registers); larger ones are clipped."""
    default: int
    """Factory value."""
    sign_bit: int
    """Sign bit of a sign-magnitude word; 0 for an unsigned register."""
    unit: str
    """Physical unit of the register's least significant bit."""
    source: str
    """Letter of the source, a key of the model's `sources`."""

    @property
    def span(self) -> range:
        """Addresses of the register's bytes."""
        return range(self.address, self.address + self.size)


NEEDED = frozenset(
    """id baud response_level min_angle max_angle max_temperature max_voltage min_voltage unload_conditions phase offset
    mode protection_current over_current_time dead_zone_cw dead_zone_ccw torque_enable acceleration goal_position
    goal_torque goal_pwm goal_speed torque_limit kp kd lock present_position present_speed present_load
    present_voltage present_temperature async_flag status moving present_current""".split()  # noqa: SIM905
)
"""Registers used by `Servo`; each must be in the model or in its `instead`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ServoModel:
    """Servo model."""

    name: str
    """Name of the model in the manufacturer's spelling."""
    number: int
    """Model number, registers 3 and 4."""
    byte_order: Literal["little", "big"]
    resolution: Annotated[int, Meta(ge=2)]
    """Counts over the span of the encoder."""
    span_deg: Annotated[float, Meta(gt=0.0, le=360.0)]
    """Span of the encoder, degrees: 360 for a magnetic encoder (wraps), less for a potentiometer."""
    speed_unit_counts: Annotated[float, Meta(gt=0.0)]
    zero_speed_is_fastest: bool
    """Whether goal speed 0 means no limit instead of no motion."""
    limits_select_motor: bool = False
    """Whether both angle limits at 0 select PWM mode (models without a mode register)."""
    middle_by_torque: bool = False
    """Whether writing 128 to the torque register makes the present position 2048."""
    modes: tuple[Mode, ...]
    """Names of `MODES` by the value of the mode register."""
    instructions: frozenset[Instruction]
    """Supported instructions; others are not answered."""
    baud_rates: tuple[Annotated[int, Meta(gt=0)], ...]
    """Baud rates by the value of the baud register, bit/s."""
    registers: Mapping[str, Register]
    instead: Mapping[str, str | int]
    """Replacement of each missing register: another register's name, or a constant."""
    power_up: Mapping[str, str]
    """RAM register to load at power-up, by EEPROM register."""
    physics: Mapping[str, float] = field(default_factory=dict)
    """Fields of `ServoParameters` with values from a data sheet."""
    sources: Mapping[str, str]
    """Source by letter."""

    @cached_property
    def knows_sync_read(self) -> bool:
        """Whether the servo answers sync reads."""
        return Instruction.SYNC_READ in self.instructions

    @property
    def wraps(self) -> bool:
        """Whether the position reading wraps to 0 after a turn."""
        return self.span_deg == 360.0

    @property
    def counts_per_turn(self) -> float:
        """Counts of 360 degrees."""
        return self.resolution * 360.0 / self.span_deg

    @cached_property
    def places(self) -> dict[str, Register]:
        """Registers by name, including replacements and constants stored beyond the addresses of the bus."""
        places = dict(self.registers)
        numbers = {name: value for name, value in self.instead.items() if isinstance(value, int)}
        for at, (name, value) in enumerate(numbers.items()):
            places[name] = Register(name, MEMORY_SIZE + 2 * at, 2, False, 0, 0xFFFF, value, 0, "", "")
        for name, other in self.instead.items():
            if isinstance(other, str):
                places[name] = places[other]
        return places

    @cached_property
    def register_at(self) -> dict[int, Register]:
        """Register by address."""
        return {address: register for register in self.registers.values() for address in register.span}

    @cached_property
    def mode_codes(self) -> tuple[int, ...]:
        """Indices into `MODES` by the value of the mode register."""
        return tuple(0 if mode == "step" else MODES.index(mode) for mode in self.modes)

    def has(self, name: str) -> bool:
        """Whether the servo has a register of this name."""
        return name in self.registers

    def span(self, first: str, *others: str) -> range:
        """Return the address range that covers some registers, ignoring missing ones."""
        spans = [place.span for name in (first, *others) if (place := self.places[name]).address < MEMORY_SIZE]
        return range(min(span.start for span in spans), max(span.stop for span in spans)) if spans else range(0)


LARGEST_BYTES = 2**20


def read_model(path: Path, known: Callable[[str], Mapping[str, Any]]) -> dict[str, Any]:
    """Return a file's content merged over that of its `like` model; `known` returns the content of a model.

    Raises:
        ValueError: the file is not TOML or has invalid keys.
        OSError: the file cannot be read.
    """
    if path.exists() and not (path.is_file() and path.stat().st_size <= LARGEST_BYTES):
        raise ValueError(f"{path}: not a file of a servo model, which has at most {LARGEST_BYTES} bytes")
    try:
        content = parsed(path.read_text(encoding="utf-8-sig"), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not TOML: {error}") from error
    like = content.get("like")
    if like is not None and (not isinstance(like, str) or like == path.stem):
        raise ValueError(f"{path}: `like` names another model, not {like!r}")
    try:
        base = {} if like is None else known(str(path.parent / like) if like.endswith(".toml") else like)
    except RecursionError as error:
        raise ValueError(f"{path}: a model cannot be like itself, by way of {like}") from error
    own = {row[0] for row in content.get("registers", ())} | set(content.get("without", ()))
    rows = [row for row in base.get("registers", ()) if row[0] not in own]
    tables = {name: {**base.get(name, {}), **content.get(name, {})} for name in ("instead", "power_up", "sources")}
    merged = {**base, **content, **tables, "registers": [*rows, *content.get("registers", ())]}
    return {name: value for name, value in merged.items() if name not in ("like", "without")}


def build_model(content: Mapping[str, Any], place: Path) -> ServoModel:
    """Return the model of a file's content.

    Raises:
        ValueError: a value is missing, of the wrong type or inconsistent; the message names file and value.
    """
    try:
        instructions = [Instruction[name] for name in content["instructions"]]
        table = {**content, "registers": _registers(content), "instructions": instructions}
        model = filled(ServoModel, table, str(place))
        _check(model)
    except KeyError as error:
        raise ValueError(f"{place}: {error} is missing or unknown") from error
    except (TypeError, ValueError, OverflowError, AttributeError) as error:
        raise ValueError(str(error) if str(place) in str(error) else f"{place}: {error}") from error
    return model


def _registers(content: Mapping[str, Any]) -> dict[str, Register]:
    number = content["number"].to_bytes(2, content["byte_order"])
    registers = {}
    for row in content["registers"]:
        if len(row) != len(Register._fields):
            raise ValueError(f"register row {row}: needs {', '.join(Register._fields)}")
        name, address, size, access, low, high, default, *rest = row
        if address in (3, 4):
            default = number[address - 3]
        registers[name] = Register(name, address, size, access == "rw", low, high, default, *rest)
    return registers


def _check(model: ServoModel) -> None:
    taken: dict[int, str] = {}
    for register in model.registers.values():
        for address in register.span:
            if address in taken or address >= MEMORY_SIZE or register.size not in (1, 2):
                raise ValueError(f"register {register.name} does not fit at address {register.address}")
            taken[address] = register.name
        if not register.low <= abs(register.default) <= register.high < 1 << (register.sign_bit or 8 * register.size):
            raise ValueError(f"register {register.name}: {register.default} is not within its range")
        if register.source not in model.sources:
            raise ValueError(f"register {register.name}: no source {register.source!r}")
    if missing := sorted(NEEDED - model.places.keys()):
        raise ValueError(f"neither a register nor a substitute for {', '.join(missing)}")
    if unknown := {*model.power_up, *model.power_up.values()} - model.registers.keys():
        raise ValueError(f"power_up names unknown registers: {', '.join(sorted(unknown))}")
    if model.places["baud"].default >= len(model.baud_rates):
        raise ValueError(f"the factory's baud register has no rate in {model.baud_rates}")
