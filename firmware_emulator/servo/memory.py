"""Register file of a servo: EEPROM and RAM, access rules, lock and power cycle."""

from functools import lru_cache

from firmware_emulator.servo.model_file import EEPROM_END, MEMORY_SIZE, Register, ServoModel
from firmware_emulator.servo.models import HLS3606M


class RegisterFile:
    """Register bytes with the access rules of the register map; `Servo` adds their meaning."""

    def __init__(self, servo: int, model: ServoModel = HLS3606M) -> None:
        """Load the factory values of `model` and the ID `servo`."""
        self.model = model
        # Name to the addresses of low and high byte (0: none) and the sign mask (0: unsigned). Precomputed because a
        # goal reads a dozen registers per servo.
        self._places = {
            name: (*_byte_places(row, model), 1 << row.sign_bit if row.sign_bit else 0)
            for name, row in model.places.items()
        }
        self._lock = model.places["lock"].address
        # Constants in place of missing registers are stored beyond the addresses of the bus.
        size = max(MEMORY_SIZE, *(row.span.stop for row in model.places.values()))
        self._eeprom = bytearray(size)
        self._put_factory_values()
        self._store(self._eeprom, model.places["id"], servo)
        self.bytes = bytearray(size)
        self._readable = memoryview(self.bytes)[:MEMORY_SIZE]
        self.power_up()

    def power_up(self) -> None:
        """Reload RAM from EEPROM, then copy the registers of the model's `power_up`."""
        self.bytes[:] = self._eeprom
        for source, target in self.model.power_up.items():
            self.set(target, self.get(source))

    def restore(self) -> None:
        """Restore all factory values except the ID."""
        servo = self.get("id")
        self._put_factory_values()
        self._store(self._eeprom, self.model.places["id"], servo)
        self.power_up()

    def get(self, name: str) -> int:
        """Return the value of a register, signed for signed registers."""
        low, high, sign = self._places[name]
        word = self.bytes[low]
        if high:
            word |= self.bytes[high] << 8
        # Inlined `decode_signed`; bits above the sign are ignored.
        return -(word & sign - 1) if word & sign else word & sign - 1 if sign else word

    def set(self, name: str, value: int) -> None:
        """Set a register from inside the servo, even a read-only one."""
        self._store(self.bytes, self.model.places[name], value)

    def keep(self, name: str) -> None:
        """Copy a register's present value to EEPROM, unless locked."""
        if not self.bytes[self._lock]:
            register = self.model.places[name]
            span = slice(register.address, register.address + register.size)
            self._eeprom[span] = self.bytes[span]

    def read(self, address: int, count: int) -> bytes:
        """Return `count` bytes; addresses beyond the map read as zero."""
        data = self._readable[address : address + count].tobytes()
        return data if len(data) == count else data.ljust(count, b"\0")

    def write(self, address: int, data: bytes) -> None:
        """Apply a bus write: read-only bytes are unchanged, values are clipped to the register's range."""
        spans, registers = _writable(self.model, address, len(data))
        for first, stop in spans:
            self.bytes[first:stop] = data[first - address : stop - address]
        for register, low, high in registers:
            # Fast path: words within the range need no clipping. Words of negative values always take the slow path.
            if not register.low <= self.bytes[low] | (self.bytes[high] << 8 if high else 0) <= register.high:
                self._store(self.bytes, register, self._bounded(register))
            if register.address < EEPROM_END:
                self.keep(register.name)

    def _bounded(self, register: Register) -> int:
        value = self.get(register.name)
        magnitude = min(max(abs(value), register.low), register.high)
        return -magnitude if value < 0 else magnitude

    def _put_factory_values(self) -> None:
        for row in self.model.places.values():
            self._store(self._eeprom, row, row.default)

    def _store(self, memory: bytearray, register: Register, value: int) -> None:
        word = encode_signed(value, register.sign_bit) if register.sign_bit else value
        memory[register.address : register.address + register.size] = word.to_bytes(
            register.size, self.model.byte_order
        )


def _byte_places(register: Register, model: ServoModel) -> tuple[int, int]:
    """Return the addresses of the low and the high byte, 0 for no high byte."""
    if register.size == 1:
        return register.address, 0
    first, second = register.span
    return (first, second) if model.byte_order == "little" else (second, first)


@lru_cache(maxsize=256)
def _writable(
    model: ServoModel, address: int, count: int
) -> tuple[tuple[tuple[int, int], ...], tuple[tuple[Register, int, int], ...]]:
    """Return the writable targets of a bus write of `count` bytes from `address`.

    Returns:
        Runs of addresses (first, one past the last), and registers with the addresses of low and high byte.
    """
    runs: list[tuple[int, int]] = []
    registers: dict[Register, None] = {}
    for at in range(address, min(address + count, MEMORY_SIZE)):
        register = model.register_at.get(at)
        if register is not None and register.writable:
            first = runs.pop()[0] if runs and runs[-1][1] == at else at
            runs.append((first, at + 1))
            registers[register] = None
    return tuple(runs), tuple((register, *_byte_places(register, model)) for register in registers)


# Signed numbers are stored as sign and magnitude, with the sign in bit 15, or in bit 10 for the load.
def encode_signed(value: int, sign_bit: int = 15) -> int:
    """Return the register word of a signed value.

    Raises:
        ValueError: the magnitude does not fit below the sign bit.
    """
    limit = (1 << sign_bit) - 1
    if not -limit <= value <= limit:
        raise ValueError(f"{value} does not fit a sign-magnitude word with sign bit {sign_bit}: limit is +-{limit}")
    return value if value >= 0 else -value | 1 << sign_bit


def decode_signed(word: int, sign_bit: int = 15) -> int:
    """Return the signed value of a register word; bits above the sign bit are ignored, as the libraries do.

    Raises:
        ValueError: the word is not a 16-bit one.
    """
    if not 0 <= word <= 0xFFFF:
        raise ValueError(f"{word} is not a 16-bit register word")
    magnitude = word & (1 << sign_bit) - 1
    return -magnitude if word >> sign_bit & 1 else magnitude
