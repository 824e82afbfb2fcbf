"""Drives servos 0 to 5 with ftservo-python-sdk 2.0.1; `python ftservo_client.py PORT` with that package on the path."""

import sys

import scservo_sdk as ft
from scservo_sdk import port_handler

port_handler.LATENCY_TIMER = 5000
port = ft.PortHandler(sys.argv[1])
assert port.openPort()
assert port.setBaudRate(1_000_000)
servos = ft.sms_sts(port)
assert [servos.ping(servo) for servo in range(6)] == [(2570, ft.COMM_SUCCESS, 0)] * 6
position, result, error = servos.ReadPos(3)
assert (result, error) == (ft.COMM_SUCCESS, 0)
assert 3270 <= position <= 3285, position
assert servos.write1ByteTxRx(2, 40, 0) == (ft.COMM_SUCCESS, 0)
assert servos.unLockEprom(2) == (ft.COMM_SUCCESS, 0)
assert servos.LockEprom(2) == (ft.COMM_SUCCESS, 0)
assert servos.write2ByteTxRx(2, 46, 77) == (ft.COMM_SUCCESS, 0)
assert servos.read2ByteTxRx(2, 46) == (77, ft.COMM_SUCCESS, 0)
reader = ft.GroupSyncRead(servos, 56, 15)
for servo in range(6):
    assert reader.addParam(servo)
for _ in range(20):
    assert reader.txRxPacket() == ft.COMM_SUCCESS
assert reader.isAvailable(5, 56, 15)[0]
assert reader.getData(5, 62, 1) == 60
for servo in range(6):
    assert servos.SyncWritePosEx(servo, 2000, 100, 50)
assert servos.groupSyncWrite.txPacket() == ft.COMM_SUCCESS
assert [servos.read2ByteTxRx(servo, 42)[0] for servo in range(6)] == [2000] * 6
port_handler.LATENCY_TIMER = 20
assert servos.ping(6)[1] == ft.COMM_RX_TIMEOUT
port.closePort()
print("done")
