"""ftservo-python-sdk 2.0.1, with its calls for positions where it has them."""

from collections.abc import Mapping, Sequence
from typing import Any

import scservo_sdk as sdk

from .registers import SCS, STS


class Driver:
    """`feetech_robots.bus_driver.BusDriver`."""

    def __init__(self, port: str, servos: Mapping[int, str]) -> None:
        scs = any(model.startswith("SCS") for model in servos.values())
        self._registers = SCS if scs else STS
        self._port = sdk.PortHandler(port)
        assert self._port.openPort()
        assert self._port.setBaudRate(1_000_000)
        self._servos: Any = sdk.scscl(self._port) if scs else sdk.sms_sts(self._port)

    def read(self, servo: int, register: str) -> int:
        """Read by `ReadPos` and `ReadSpeed`, or by the call for the register's size."""
        address, size, sign = self._registers[register]
        special = {"present_position": "ReadPos", "present_speed": "ReadSpeed"}.get(register)
        if special:
            value, result, error = getattr(self._servos, special)(servo)
        else:
            call = self._servos.read1ByteTxRx if size == 1 else self._servos.read2ByteTxRx
            value, result, error = call(servo, address)
            value = self._servos.scs_tohost(value, sign) if sign else value
        self._check(result, error)
        return int(value)

    def write(self, servo: int, register: str, value: int) -> None:
        """Write by `WritePosEx`, or by the call for the register's size."""
        address, size, sign = self._registers[register]
        if register == "goal_position" and self._registers is STS:
            self._check(*self._servos.WritePosEx(servo, value, 0, 0))
            return
        word = self._servos.scs_toscs(value, sign) if sign else value
        call = self._servos.write1ByteTxRx if size == 1 else self._servos.write2ByteTxRx
        self._check(*call(servo, address, word))

    def sync_read(self, register: str, servos: Sequence[int]) -> dict[int, int | None]:
        """Read by `GroupSyncRead`, as its example does: what is available, whatever the result."""
        address, size, sign = self._registers[register]
        group = sdk.GroupSyncRead(self._servos, address, size)
        for servo in servos:
            group.addParam(servo)
        result = group.txRxPacket()
        found: dict[int, int | None] = {
            servo: self._servos.scs_tohost(group.getData(servo, address, size), sign)
            for servo in servos
            if group.isAvailable(servo, address, size)[0]
        }
        if not found:
            self._check(result, 0)
        return found

    def sync_write(self, register: str, values: Mapping[int, int]) -> None:
        """Write by `SyncWritePosEx`, which is for goals."""
        if register != "goal_position":
            raise NotImplementedError
        for servo, value in values.items():
            self._servos.SyncWritePosEx(servo, value, 0, 0)
        self._check(self._servos.groupSyncWrite.txPacket(), 0)
        self._servos.groupSyncWrite.clearParam()

    def store(self, servo: int, register: str, value: int) -> None:
        """Write between `unLockEprom` and `LockEprom`, as its example does."""
        self._check(*self._servos.unLockEprom(servo))
        self.write(servo, register, value)
        self._check(*self._servos.LockEprom(servo))

    def middle(self, servo: int) -> None:
        """It has no call for it."""
        raise NotImplementedError

    def close(self) -> None:
        """Close the port."""
        self._port.closePort()

    def _check(self, result: int, error: int) -> None:
        if result != sdk.COMM_SUCCESS:
            raise ConnectionError(self._servos.getTxRxResult(result))
        if error:
            raise RuntimeError(self._servos.getRxPacketError(error))
