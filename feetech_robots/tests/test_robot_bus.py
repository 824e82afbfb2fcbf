"""Any robot of bus servos: a TOML and an MJCF file, on virtual time."""

import math
from pathlib import Path

import pytest
from feetech_robots.robot_bus import RobotBus, obey
from feetech_robots.robot_file import read_robot

from firmware_emulator.packets import pack

pytest_plugins = ["pytester"]
ROOT = Path(__file__).parents[1]
ARM = ROOT / "examples/arm/arm.toml"
READ, WRITE, SYNC_READ = 2, 3, 0x82

PENDULUM = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="swing" axis="0 1 0" range="-115 115" limited="true" armature="0.01"/>
      <geom type="capsule" size="0.01" fromto="0 0 0 0 0 0.1" mass="0.1"/>
      <body pos="0 0 0.1">
        <joint name="slide" type="slide" axis="0 0 1" range="-0.001 0.001" limited="true"/>
        <geom type="sphere" size="0.01" mass="0.01"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="old" joint="swing" kp="100"/></actuator>
  <keyframe><key name="home" qpos="0 0" ctrl="1"/></keyframe>
</mujoco>
"""
ROBOT = """
mjcf = "pendulum.xml"
[[servos]]
id = 9
model = "STS3215"
joint = "swing"
direction = -1
zero_counts = 1000
gear = 2.0
start_deg = 10.0
"""


@pytest.fixture
def pendulum(tmp_path):
    """Write a robot of one joint; returns what builds it, with lines changed."""

    def build(*changes, mjcf=PENDULUM):
        text = ROBOT
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "pendulum.xml").write_text(mjcf)
        (tmp_path / "pendulum.toml").write_text(text)
        return RobotBus.of_file(tmp_path / "pendulum.toml")

    return build


class Master:
    """Asks one servo at a time, encoded here once more."""

    def __init__(self, robot):
        self.link = robot.link()

    def ask(self, servo, code, parameters=b""):
        self.link.discard_input()
        self.link.write(pack(servo, code, bytes(parameters)))
        return self.link.read(64, 0.01)

    def position(self, servo):
        return int.from_bytes(self.ask(servo, READ, (56, 2))[5:7], "little")

    def go_to(self, servo, counts):
        assert self.ask(servo, WRITE, bytes((42,)) + counts.to_bytes(2, "little")) == pack(servo, 0)


def test_a_new_robot_is_one_toml_beside_its_mjcf(pendulum):
    """Direction, zero and gear: counts = zero + direction x gear x angle; the file's own actuator is gone."""
    robot = pendulum()
    master = Master(robot)
    assert master.position(9) == pytest.approx(1000 - 2 * 10 * 4096 / 360, abs=1)
    master.go_to(9, 1500)
    robot.wait(2.0)
    assert robot.joint_deg("swing") == pytest.approx(-500 / 2 * 360 / 4096, abs=0.2)
    assert master.position(9) == pytest.approx(1500, abs=2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([("id = 9", "id = 254")], r"servos\[0\].id: expected `int` <= 253"),
        ([("id = 9", 'id = "nine"')], r"servos\[0\].id: expected `int`, got text"),
        ([("id = 9\n", "")], r"servos\[0\]: missing key `id`"),
        ([("gear = 2.0", "gears = 2.0")], r"servos\[0\]: unknown key `gears`; did you mean `gear`"),
        ([("gear = 2.0", "joint_damping = -1")], r"joint_damping: expected `float` >= 0.0"),
        ([("gear = 2.0", "gear = 0")], r"gear: expected `float` > 0.0"),
        ([("direction = -1", "direction = 0")], "direction is one of 1, -1, not 0"),
        ([("STS3215", "STS9999")], "unknown servo model 'STS9999'"),
        ([("gear = 2.0", "physics = {torque = 1}")], r"servos\[0\]: servo model STS3215"),
        ([("gear = 2.0", "physics = {stall_torque = -1}")], "must be positive"),
        ([("swing", "swings")], "no hinge joint 'swings'; it has swing"),
        ([("swing", "slide")], "no hinge joint 'slide'"),
        ([("pendulum.xml", "none.xml")], "no such file"),
        ([("mjcf", "xml")], "unknown key `xml`"),
        ([("[[servos]]", "[servos]")], "servos: expected a list, got a table"),
        ([("start_deg", "[[servos]]\nid = 8\nmodel = 'STS3215'\njoint = 'swing'\nstart_deg")], "two servos turn swing"),
    ],
)
def test_a_robot_that_cannot_be_is_refused_with_the_reason(pendulum, changes, message):
    with pytest.raises((ValueError, OSError), match=message):
        pendulum(*changes)


def test_a_model_that_cannot_be_simulated_names_file_joint_time_and_what_to_try(pendulum, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stiff = PENDULUM.replace("<option ", '<option timestep="0.02" ').replace('armature="0.01"', 'stiffness="500"')
    robot = pendulum(mjcf=stiff)
    said = r"pendulum.xml: MuJoCo cannot simulate it at joint 's\w+', between .* s .*timestep>, here 0.02 s"
    with pytest.raises(ArithmeticError, match=said):
        robot.wait(1.0)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


@pytest.mark.parametrize("number", ["nan", "-1.0", "1e300"])
@pytest.mark.parametrize("field", ["voltage", "stall_torque", "cooling_s", "loop_period_s"])
def test_a_number_that_no_servo_has_is_refused(pendulum, field, number):
    with pytest.raises(ValueError, match=rf"servos\[0\]: .*{field}|stall torque"):
        pendulum(("gear = 2.0", f"physics = {{{field} = {number}}}"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('like = "mine.toml"\n', "a model cannot be like itself"),
        ("like = 3\n", "`like` names another model, not 3"),
        ('like = "STS3215"\nspeed_units = 3\n', "unknown key `speed_units`; did you mean `speed_unit_counts`"),
        ('like = "STS3215"\nspeed_unit_counts = nan\n', "speed_unit_counts must be finite"),
    ],
)
def test_a_servo_model_that_is_none_names_its_file(pendulum, tmp_path, text, message):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(ValueError, match=rf"mine.toml.*{message}"):
        pendulum(("STS3215", "mine.toml"))


def test_a_mesh_that_is_a_git_lfs_pointer_is_called_that(pendulum, tmp_path):
    (tmp_path / "link.stl").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 9\n")
    mesh = '<asset><mesh name="link" file="link.stl"/></asset><worldbody><geom type="mesh" mesh="link"/>'
    with pytest.raises(ValueError, match=r"link.stl is a Git LFS pointer: run `git lfs pull`"):
        pendulum(mjcf=PENDULUM.replace("<worldbody>", mesh))


def test_an_mjcf_that_is_none_names_its_file(pendulum):
    with pytest.raises(ValueError, match=r"pendulum.xml: MuJoCo does not read it"):
        pendulum(mjcf="<mujoco><worldbody>")


def test_a_model_of_ones_own_lies_beside_the_robot(pendulum, tmp_path):
    (tmp_path / "mine.toml").write_text('like = "STS3215"\nname = "mine"\nnumber = 4321\n')
    robot = pendulum(("STS3215", "mine.toml"))
    assert Master(robot).ask(9, READ, (3, 2))[5:7] == (4321).to_bytes(2, "little")


def test_a_blocked_joint_pushes_no_harder_than_its_servo_times_its_gear(pendulum):
    """2.94 N m (30 kg cm) at the shaft, a gear of 2."""
    robot = pendulum()
    master = Master(robot)
    master.go_to(9, 3900)
    robot.wait(1.5)
    assert abs(robot.plant.efforts()[0]) == pytest.approx(2.94, rel=0.01)
    pushed = robot.plant.data.qfrc_actuator[robot.plant.model.joint("swing").dofadr[0]]
    assert abs(pushed) == pytest.approx(2 * 2.94, rel=0.02)


def test_a_damping_replaces_that_of_the_file(pendulum):
    """The servo's own voltage stays: 2.94 N m over 4.71 rad/s at the shaft, four times that behind a gear of 2."""
    damped = PENDULUM.replace('armature="0.01"', 'armature="0.01" damping="9"')
    speeds = []
    for mjcf, damping in ((damped, "gear = 2.0"), (damped, "gear = 2.0\njoint_damping = 0")):
        robot = pendulum(("gear = 2.0", damping), mjcf=mjcf)
        Master(robot).go_to(9, 3500)
        robot.wait(0.2)
        robot.joint_deg("swing")
        speeds.append(abs(robot.plant.speeds()[0]))
    slow, fast = speeds
    assert fast == pytest.approx(4.71, rel=0.05)
    assert slow < 0.4 * fast


def test_the_hand_of_a_person_moves_a_limp_joint_and_no_driven_one(pendulum):
    robot = pendulum()
    robot.hold("swing", -60.0)
    robot.wait(1.0)
    assert robot.joint_deg("swing") == pytest.approx(-60.0, abs=0.5)
    robot.let_go("swing")
    robot.hold("swing", -20.0)
    master = Master(robot)
    master.go_to(9, 1000)
    robot.wait(1.0)
    assert robot.joint_deg("swing") == pytest.approx(0.0, abs=0.2)
    assert master.ask(9, WRITE, (40, 0)) == pack(9, 0)
    robot.wait(1.0)
    assert robot.joint_deg("swing") == pytest.approx(-20.0, abs=0.5)


def test_the_arm_of_the_examples_reads_six_servos_at_once():
    robot = RobotBus.of_file(ARM)
    master = Master(robot)
    answers = master.ask(0xFE, SYNC_READ, (56, 2, *range(1, 7)))
    assert [answers[at + 2] for at in range(0, 48, 8)] == [1, 2, 3, 4, 5, 6]
    # The elbow's range goes over the wrap of its encoder until an offset of -1748 puts zero, 300, at 2048.
    assert master.ask(3, WRITE, bytes((31,)) + (1748 | 1 << 11).to_bytes(2, "little")) == pack(3, 0)
    for servo in range(1, 7):
        master.go_to(servo, 2000 if servo == 6 else 2048)
    robot.wait(3.0)
    # What the gain leaves under the weight of the links: 2.94 N m x 0.00862 a count.
    assert max(abs(robot.joint_deg(joint)) for joint in ("elbow_flex", "wrist_flex")) < 10.0
    assert robot.joint_deg("gripper") == pytest.approx((2000 - 1500) * 360 / 4096, abs=0.5)


def test_the_arm_agrees_with_what_its_files_say():
    robot = read_robot(ARM)
    built = RobotBus(robot)
    for servo in robot.servos:
        assert built.joint_deg(servo.joint) == pytest.approx(servo.start_deg, abs=1e-6)
    assert [servo.id for servo in robot.servos] == [1, 2, 3, 4, 5, 6]
    assert built.plant.model.nu == 3 * 6


def test_orders_silence_heat_and_starve(pendulum):
    robot = pendulum()
    master = Master(robot)
    obey(robot, "silence 9 0.3")
    assert master.ask(9, READ, (56, 2)) == b""
    robot.wait(0.3)
    assert len(master.ask(9, READ, (56, 2))) == 8
    obey(robot, "heat 9 75")
    robot.wait(0.2)
    assert master.ask(9, 1)[4] == 0x04
    obey(robot, "heat 9 30")
    obey(robot, "supply 3.0")
    robot.wait(0.2)
    assert master.ask(9, 1)[4] == 0x01
    obey(robot, "hold swing 5")
    obey(robot, "let_go swing")
    assert obey(robot, "poke 9 offset -1000") == "done"
    assert obey(robot, "peek 9 offset") == "-1000"
    obey(robot, "power_cycle")
    assert obey(robot, "peek 9 offset") == "0"
    obey(robot, "late 0.05")
    assert master.ask(9, READ, (56, 2)) == b""
    assert len(master.link.read(8, 0.06)) == 8
    assert len(master.ask(9, READ, (56, 2))) == 8
    assert float(obey(robot, "now")) == pytest.approx(robot.chain.clock.now())


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("dance", "is not an order; orders are: hold JOINT DEGREES"),
        ("hold swings 3", "no joint 'swings'; it has swing"),
        ("silence 3 1", "no servo with ID 3; it has 9"),
        ("hold swing far", "could not convert"),
        ("hold swing nan", "swing reaches -115 to 115 degrees, not nan"),
        ("hold swing 1e300", "swing reaches -115 to 115 degrees"),
        ("supply 120", "a supply is 0 to 25.5 V, not 120"),
        ("supply nan", "a supply is 0 to 25.5 V"),
        ("heat 9 300", "a temperature is 0 to 150 °C"),
        ("late -1", "a delay is 0 to 3600 s"),
        ("silence 9 inf", "a silence is 0 to 3600 s"),
        ("poke 9 id 300", "register id is 0 to 255"),
        ("poke 9 offset 5000", "5000 does not fit"),
        ("peek 9 torque", "no register 'torque' in an STS3215"),
        ("now now", "is not an order"),
        ("", "is not an order"),
    ],
)
def test_an_order_that_is_none_says_what_is(pendulum, line, message):
    with pytest.raises(ValueError, match=message):
        obey(pendulum(), line)


def test_the_same_calls_give_the_same_bytes():
    first, second = (RobotBus.of_file(ARM, seed=3) for _ in range(2))
    for robot in (first, second):
        robot.master = Master(robot)
        robot.master.go_to(2, 2500)
        robot.wait(0.7)
    assert first.master.ask(2, READ, (56, 15)) == second.master.ask(2, READ, (56, 15))
    assert math.isfinite(first.joint_deg("shoulder_lift"))


def test_the_fixture_serves_the_robot_of_the_mark_or_the_option(pytester):
    pytester.makepyfile(
        f"""
        import pytest

        @pytest.mark.robot({str(ARM)!r})
        def test_marked(bus_target):
            bus_target.wait(0.1)
            assert bus_target.joint_deg("gripper") == pytest.approx(0.0, abs=1.0)

        def test_option(bus_target):
            assert len(bus_target.chain.servos) == 6
        """
    )
    pytester.runpytest(f"--bus-robot={ARM}").assert_outcomes(passed=2)
    result = pytester.runpytest()
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*bus_target needs a robot*--bus-robot=PATH*"])


def test_a_joint_starts_within_its_range(pendulum):
    """One that starts beyond it was flung: by 0 where 0 is no angle of it, or by start_deg."""
    beyond = PENDULUM.replace("-115 115", "20 60")
    assert beyond != PENDULUM
    built = pendulum(("start_deg = 10.0", ""), mjcf=beyond)
    assert built.joint_deg("swing") == pytest.approx(20.0)
    assert built.plant.moved == ["swing turns 20 to 60 degrees, so it starts at 20; start_deg says where"]
    with pytest.raises(ValueError, match="swing turns 20 to 60 degrees, and cannot start at 10"):
        pendulum(mjcf=beyond)
    assert pendulum(("start_deg = 10.0", "start_deg = 30.0"), mjcf=beyond).plant.moved == []
