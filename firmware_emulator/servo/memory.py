"""A servo's register file: what reads return and writes leave, EEPROM and RAM, lock and power cycle."""

from __future__ import annotations

from functools import lru_cache

from firmware_emulator.servo.encoding import decode_signed, encode_signed
from firmware_emulator.servo.models import HLS3606M, ServoModel
from firmware_emulator.servo.registers import EEPROM_END, MEMORY_SIZE, POWER_UP_COPIES, REGISTER_AT, REGISTERS, Register

LOCK = REGISTERS["lock"].address


class RegisterFile:
    """Bytes with the rules of the register map; meaning is added by the servo."""

    def __init__(self, servo: int, model: ServoModel = HLS3606M) -> None:
        """Hold a model's factory values for the servo with this ID."""
        self._sign_bits = {"offset": model.offset_sign_bit}
        # Name to address, size and bit of the sign, 0 for none: a goal reads a dozen registers of each servo.
        self._places = {
            register.name: (
                register.address,
                register.size,
                self._sign_bits.get(register.name, 15) if register.signed else 0,
            )
            for register in REGISTERS.values()
        }
        self._factory = {register.name: register.default for register in REGISTERS.values()} | dict(model.factory)
        self._eeprom = bytearray(MEMORY_SIZE)
        self._put_factory_values()
        self._store(self._eeprom, REGISTERS["id"], servo)
        self.bytes = bytearray(MEMORY_SIZE)
        self.power_up()

    def power_up(self) -> None:
        """Forget RAM: load EEPROM, then the registers that start as copies of others."""
        self.bytes[:] = self._eeprom
        for source, target in POWER_UP_COPIES.items():
            self.set(target, self.get(source))

    def restore(self) -> None:
        """Put factory values everywhere except the ID."""
        servo = self.get("id")
        self._put_factory_values()
        self._store(self._eeprom, REGISTERS["id"], servo)
        self.power_up()

    def get(self, name: str) -> int:
        """Return a register's value, signed where the register is."""
        address, size, sign_bit = self._places[name]
        word = self.bytes[address]
        if size == 2:
            word |= self.bytes[address + 1] << 8
        return decode_signed(word, sign_bit) if sign_bit else word

    def set(self, name: str, value: int) -> None:
        """Set a register from inside the servo, whether or not a bus write may."""
        self._store(self.bytes, REGISTERS[name], value)

    def keep(self, name: str) -> None:
        """Copy a register's present value to EEPROM if the lock permits, as calibration does."""
        register = REGISTERS[name]
        if not self.bytes[LOCK]:
            span = slice(register.address, register.address + register.size)
            self._eeprom[span] = self.bytes[span]

    def read(self, address: int, count: int) -> bytes:
        """Return `count` bytes; addresses behind the map read as zero."""
        data = bytes(self.bytes[address : address + count])
        return data if len(data) == count else data.ljust(count, b"\0")

    def write(self, address: int, data: bytes) -> None:
        """Apply a bus write: read-only bytes are left, values out of a register's range are brought to its edge."""
        places, registers = _writable(address, len(data))
        for at in places:
            self.bytes[at] = data[at - address]
        for register in registers:
            self._store(self.bytes, register, self._bounded(register))
            if register.address < EEPROM_END:
                self.keep(register.name)

    def _bounded(self, register: Register) -> int:
        value = self.get(register.name)
        magnitude = min(max(abs(value), register.low), register.high)
        return -magnitude if value < 0 else magnitude

    def _put_factory_values(self) -> None:
        for name, value in self._factory.items():
            self._store(self._eeprom, REGISTERS[name], value)

    def _store(self, memory: bytearray, register: Register, value: int) -> None:
        word = encode_signed(value, self._sign_bits.get(register.name, 15)) if register.signed else value
        memory[register.address : register.address + register.size] = word.to_bytes(register.size, "little")


@lru_cache(maxsize=256)
def _writable(address: int, count: int) -> tuple[tuple[int, ...], tuple[Register, ...]]:
    """Return what a bus write of `count` bytes from `address` changes: addresses and registers."""
    found = {}
    for at in range(address, min(address + count, MEMORY_SIZE)):
        register = REGISTER_AT.get(at) or REGISTER_AT.get(at - 1)
        if register is not None and register.writable and at < register.address + register.size:
            found[at] = register
    return tuple(found), tuple(dict.fromkeys(found.values()))
