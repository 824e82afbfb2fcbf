"""feetech-servo-sdk 1.0.0, with the helpers that it has for signs."""

from collections.abc import Mapping, Sequence

import scservo_sdk as sdk

from .registers import SCS, STS


class Driver:
    """`feetech_robots.bus_driver.BusDriver`."""

    def __init__(self, port: str, servos: Mapping[int, str]) -> None:
        scs = any(model.startswith("SCS") for model in servos.values())
        self._registers = SCS if scs else STS
        self._port = sdk.PortHandler(port)
        self._packets = sdk.PacketHandler(int(scs))
        assert self._port.openPort()
        assert self._port.setBaudRate(1_000_000)

    def read(self, servo: int, register: str) -> int:
        """Read by the call for the register's size."""
        address, size, sign = self._registers[register]
        call = self._packets.read1ByteTxRx if size == 1 else self._packets.read2ByteTxRx
        value, result, error = call(self._port, servo, address)
        self._check(result, error)
        return int(sdk.SCS_TOHOST(value, sign) if sign else value)

    def write(self, servo: int, register: str, value: int) -> None:
        """Write by the call for the register's size."""
        address, size, sign = self._registers[register]
        word = sdk.SCS_TOSCS(value, sign) if sign else value
        call = self._packets.write1ByteTxRx if size == 1 else self._packets.write2ByteTxRx
        self._check(*call(self._port, servo, address, word))

    def sync_read(self, register: str, servos: Sequence[int]) -> dict[int, int | None]:
        """Read by `GroupSyncRead`, as its example does: what is available, whatever the result."""
        address, size, sign = self._registers[register]
        group = sdk.GroupSyncRead(self._port, self._packets, address, size)
        for servo in servos:
            group.addParam(servo)
        self._check(group.txRxPacket(), 0)
        return {
            servo: sdk.SCS_TOHOST(group.getData(servo, address, size), sign)
            for servo in servos
            if group.isAvailable(servo, address, size)
        }

    def sync_write(self, register: str, values: Mapping[int, int]) -> None:
        """Write by `GroupSyncWrite`."""
        address, size, sign = self._registers[register]
        group = sdk.GroupSyncWrite(self._port, self._packets, address, size)
        for servo, value in values.items():
            word = sdk.SCS_TOSCS(value, sign)
            group.addParam(servo, [sdk.SCS_LOBYTE(word), sdk.SCS_HIBYTE(word)])
        self._check(group.txPacket(), 0)

    def store(self, servo: int, register: str, value: int) -> None:
        """It has no call for it."""
        raise NotImplementedError

    def middle(self, servo: int) -> None:
        """It has no call for it."""
        raise NotImplementedError

    def close(self) -> None:
        """Close the port."""
        self._port.closePort()

    def _check(self, result: int, error: int) -> None:
        if result != sdk.COMM_SUCCESS:
            raise ConnectionError(self._packets.getTxRxResult(result))
        if error:
            raise RuntimeError(self._packets.getRxPacketError(error))
