"""Programs nobody here wrote, unmodified, against the emulated hand on a pseudo-terminal in real time.

Their own patience (10 ms for a reading) is lengthened where they let a user do so: on a loaded machine a test must not
depend on when the scheduler comes round. `test_most_readings_come_within_the_clients_own_ten_milliseconds` is the
exception, and slow.
"""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import aero_open_sdk.aero_hand as sdk
import pytest
import scservo_sdk as feetech

HERE = Path(__file__).parent
PATIENCE_S = 5.0


@contextlib.contextmanager
def served(folder, *, firmware="0.2.0", start="homed", ids="0123456", model="HLS3606M"):
    """A hand in its own process; yields the links of its board and its bus."""
    link, bus_link = folder / "hand", folder / "bus"
    process = subprocess.Popen(
        [sys.executable, str(HERE / "serve_bench.py"), str(link), str(bus_link), firmware, start, ids, model],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout.readline() == f"ready {link}\n"
        yield link, bus_link
    finally:
        process.send_signal(signal.SIGTERM)
        with process.stdout:
            assert process.wait(PATIENCE_S) == 0
    assert not link.is_symlink()
    assert not bus_link.is_symlink()


def patient_hand(link):
    hand = sdk.AeroHand(str(link))
    hand.ser.timeout = hand.ser.write_timeout = PATIENCE_S
    return hand


def test_every_public_method_of_the_official_sdk(tmp_path):
    with served(tmp_path) as (link, _):
        hand = patient_hand(link)
        hand.set_joint_positions([0.0] * 16)
        hand.set_actuations([0.0] * 7)
        hand.run_trajectory([([0.0] * 7, 0.0), ([10.0] * 7, 0.1)])
        assert hand.set_speed(3, 2400) == {"Servo ID": 3, "Speed": 2400}
        assert hand.set_torque(6, 900) == {"Servo ID": 6, "Torque": 900}
        assert hand.trim_servo(3, -10) == {"Servo ID": 3, "Extend Count": 3278 - 113}
        assert hand.set_id(5, 1023) == {"Old_id": 0xFFFF, "New_id": 0xFFFF, "Current_limit": 0xFFFF}
        for read, low, high in (
            (hand.get_actuations, -16, 289),
            (hand.get_joint_positions_compact, -30, 120),
            (hand.get_actuator_currents, -7000, 7000),
            (hand.get_actuator_temperatures, 20, 60),
            (hand.get_actuator_speeds, -130, 130),
        ):
            values = read()
            assert len(values) == 7
            assert all(low <= value <= high for value in values)
        hand.ctrl_torque([100] * 7)
        for missing in (hand.get_forward_kinematics, hand.get_joint_positions):
            with pytest.raises(NotImplementedError):
                missing()
        for refused in (
            lambda: hand.set_id(254, 100),
            lambda: hand.set_speed(7, 100),
            lambda: hand.set_torque(0, 1001),
            lambda: hand.trim_servo(0, 361),
            lambda: hand.ctrl_torque([1001] * 7),
        ):
            with pytest.raises(ValueError, match=r"must be|out of range"):
                refused()
        hand.close()


def test_the_sdk_moves_the_hand_where_it_says(tmp_path):
    with served(tmp_path) as (link, _):
        hand = patient_hand(link)
        target = [50.0, 40.0, 100.0, 200.0, 150.0, 100.0, 50.0]
        hand.set_actuations(target)
        for _ in range(60):
            hand.ser.timeout = 0.02
            hand.ser.read(1)
            hand.ser.timeout = PATIENCE_S
            reached = hand.get_actuations()
        assert reached == pytest.approx(target, abs=0.5)
        hand.close()


def test_settings_that_the_old_firmware_does_not_know_time_out(tmp_path, monkeypatch):
    with served(tmp_path, firmware="pre") as (link, _):
        hand = patient_hand(link)
        wait = hand._wait_for_ack
        monkeypatch.setattr(hand, "_wait_for_ack", lambda opcode, _timeout: wait(opcode, 0.3))
        hand.ser.timeout = 0.1
        with pytest.raises(TimeoutError, match="0x31"):
            hand.set_speed(0, 100)
        hand.close()


@pytest.mark.slow
def test_the_sdk_homes_to_the_acknowledgement(tmp_path):
    with served(tmp_path) as (link, _):
        hand = patient_hand(link)
        assert hand.send_homing(timeout_s=20.0) is True
        hand.close()


@pytest.mark.slow
def test_most_readings_come_within_the_clients_own_ten_milliseconds(tmp_path):
    with served(tmp_path) as (link, _):
        hand = sdk.AeroHand(str(link))
        readings = [hand.get_actuations() for _ in range(300)]
        assert sum(reading is not None for reading in readings) >= 290
        hand.close()


@pytest.fixture
def patient_feetech(monkeypatch):
    """Lengthen the time the client waits for an answer that does come."""

    def patience(milliseconds):
        monkeypatch.setattr(feetech.port_handler, "LATENCY_TIMER", milliseconds)

    patience(PATIENCE_S * 1000)
    return patience


def test_feetech_servo_sdk_on_the_bus(tmp_path, patient_feetech):
    with served(tmp_path, ids="012345") as (_, bus_link):
        port, packets = feetech.PortHandler(str(bus_link)), feetech.PacketHandler(0)
        assert port.openPort()
        assert port.setBaudRate(1_000_000)
        assert [packets.ping(port, servo) for servo in range(6)] == [(2570, feetech.COMM_SUCCESS, 0)] * 6
        assert packets.read1ByteTxRx(port, 2, 5) == (2, feetech.COMM_SUCCESS, 0)
        assert packets.write1ByteTxRx(port, 2, 40, 0) == (feetech.COMM_SUCCESS, 0)
        assert packets.write2ByteTxRx(port, 2, 46, 1234) == (feetech.COMM_SUCCESS, 0)
        assert packets.read2ByteTxRx(port, 2, 46) == (1234, feetech.COMM_SUCCESS, 0)
        reader = feetech.GroupSyncRead(port, packets, 56, 15)
        for servo in range(6):
            assert reader.addParam(servo)
        for _ in range(20):
            assert reader.txRxPacket() == feetech.COMM_SUCCESS
        assert all(reader.isAvailable(servo, 56, 2) for servo in range(6))
        assert reader.getData(3, 62, 1) == 60
        writer = feetech.GroupSyncWrite(port, packets, 46, 2)
        for servo in range(6):
            assert writer.addParam(servo, [servo, 1])
        assert writer.txPacket() == feetech.COMM_SUCCESS
        assert [packets.read2ByteTxRx(port, servo, 46)[0] for servo in range(6)] == [256 + servo for servo in range(6)]
        patient_feetech(20)
        assert packets.ping(port, 6)[1] == feetech.COMM_RX_TIMEOUT
        port.closePort()


def run_client(program, bus_link, folder):
    """Run a client in a process of its own, with its package in front of those of the same name."""
    client = subprocess.run(
        [sys.executable, str(HERE / program), str(bus_link)],
        env={**os.environ, "PYTHONPATH": folder},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (client.returncode, client.stdout.splitlines()[-1:]) == (0, ["done"]), client.stderr


def test_ftservo_python_sdk_on_the_bus(tmp_path):
    """In a process of its own: it and feetech-servo-sdk install into the same package name."""
    folder = os.environ.get("FTSERVO_SDK")
    if folder is None:
        pytest.skip(
            "needs FTSERVO_SDK, the folder of `pip install --no-deps --target FOLDER ftservo-python-sdk==2.0.1`"
        )
    with served(tmp_path, ids="012345") as (_, bus_link):
        run_client("ftservo_client.py", bus_link, folder)


@pytest.mark.slow
def test_lerobot_finds_the_servos_at_one_baud_rate_and_shakes_hands_with_an_sts3215(tmp_path):
    """Eleven baud rates, each with an answer to wait for: 16 s."""
    folder = os.environ.get("LEROBOT")
    if folder is None:
        packages = "lerobot==0.4.4 'deepdiff<9' orderly-set tqdm"
        pytest.skip(f"needs LEROBOT, the folder of `pip install --no-deps --target FOLDER {packages}`")
    with served(tmp_path, ids="012345", model="STS3215") as (_, bus_link):
        run_client("lerobot_client.py", bus_link, folder)
