"""`aero-hil setup`: from an unknown hand to its name, without a motion before its question."""

from contextlib import contextmanager

import pytest
from click.testing import CliRunner

from aero.firmware import FIRMWARE
from aero.safety import SafetyStopError
from hil import emulate
from hil.checks.look.check import NONE
from hil.cli import main, setup
from hil.cli.doctor.ports import SPANS, Answers
from hil.dialogue.asker import Choice
from hil.targets.hands_file import FILE, read_hands

HOMED = tuple(span // 3 * 65535 // span for span in SPANS.tolist())


class Owner:
    """Owner of a hand, who reads each question and follows its motion; leaves at a question with these words."""

    def __init__(self, side, *, leaves_at="", sees=None):
        self.side, self.leaves_at, self.sees = side, leaves_at, sees or {}
        self.asked, self.told = [], []

    def ask(self, question):
        self.asked.append(question.text)
        if self.leaves_at and self.leaves_at in question.text:
            raise KeyboardInterrupt
        if not isinstance(question, Choice):
            return "bench"
        if question.text == setup.SIDE:
            return self.side
        if question.motion:
            return self.sees.get(question.motion, question.motion)
        return question.options[-1].answer

    def announce(self, motion):
        self.told.append(motion.text)

    def tell(self, text):
        self.told.append(text)

    def progress(self, *_):
        pass


@pytest.fixture
def owned(tmp_path, monkeypatch):
    """Return a function that sets up a hand whose board runs a version; it returns what commands were sent."""
    monkeypatch.chdir(tmp_path)

    def go(owner, version, side):
        row, logs = FIRMWARE[version], []
        answers = Answers(
            HOMED, knows_limits=row.settings is not None, knows_calibrate_mid=row.calibrate_mid, boot_text=""
        )
        monkeypatch.setattr(setup, "ask", lambda _port: answers)

        def opened(spec):
            runs = () if spec.firmware == version else (f"board_runs_{version}",)
            assert spec.side == side
            logs.append(spec.firmware)
            return emulate(firmware=spec.firmware, side=side, faults=runs, guarded=True)

        setup.set_up(owner, "/dev/ttyACM7", opened)
        return logs

    return go


@pytest.mark.parametrize(
    ("version", "side", "written"),
    [
        ("0.2.0", "right", "0.2.0"),
        pytest.param("0.1.4", "left", "0.1.5", marks=pytest.mark.slow),
        pytest.param("0.1.1", "right", "0.1.2", marks=pytest.mark.slow),
        pytest.param("pre", "right", "pre", marks=pytest.mark.slow),
        pytest.param("main", "left", "main", marks=pytest.mark.slow),
    ],
)
def test_a_new_hand_gets_a_name_and_a_version_that_moves_alike(owned, version, side, written):
    """An owner who is not sure of the version gets the newest of those that move like the hand."""
    owner = Owner(side)
    owned(owner, version, side)
    hand = read_hands(setup.Path(FILE))["bench"]
    assert (hand["port"], hand["side"], hand["firmware"]) == ("/dev/ttyACM7", side, written)
    assert owner.told[-1] == "next: aero-hil validate --hil bench"


def test_a_channel_that_moves_another_digit_is_told(owned):
    owner = Owner("right", sees={"index": "ring", "pinky": NONE})
    owned(owner, "main", "right")
    odd = [line for line in owner.told if line.startswith("The command of")]
    assert len(odd) == 2
    assert "index" in odd[0]
    assert "ring" in odd[0]
    assert "nothing" in odd[1]


@pytest.mark.parametrize("words", ["Name", setup.SIDE, "Take everything out", "Each channel moves", "was it?"])
def test_an_owner_who_leaves_leaves_no_file_and_a_hand_that_moved_only_when_asked(owned, words):
    owner = Owner("right", leaves_at=words)
    with pytest.raises(KeyboardInterrupt):
        owned(owner, "main", "right")
    assert not setup.Path(FILE).exists()
    assert words in owner.asked[-1]


def test_nothing_is_opened_before_the_owner_says_home(owned, monkeypatch):
    monkeypatch.setattr(setup, "open_spec", pytest.fail)
    with pytest.raises(KeyboardInterrupt):
        owned(Owner("right", leaves_at="Take everything out"), "0.2.0", "right")


def test_a_port_is_the_one_that_appears_when_plugged_in(monkeypatch):
    class Port:
        vid = pid = None

        def __init__(self, device):
            self.device = device

    states = iter([[], [Port("/dev/a")], [Port("/dev/a")], [Port("/dev/a")], [Port("/dev/a"), Port("/dev/b")]])
    monkeypatch.setattr(setup, "comports", lambda: next(states))
    owner = Owner("right")
    assert setup._port(owner) == "/dev/b"
    assert len(owner.asked) == 4


def test_a_folder_that_cannot_be_written_ends_it_before_the_first_question(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(setup.os, "access", lambda *_: False)
    ran = CliRunner().invoke(main, ["setup", "--hil", "/dev/ttyACM7"])
    assert ran.exit_code == 2
    assert "read-only" in ran.output


def test_the_end_of_the_input_interrupts_it(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    ran = CliRunner().invoke(main, ["setup", "--hil", "/dev/ttyACM7"], input="bench\n")
    assert ran.exit_code != 0
    assert not (tmp_path / FILE).exists()


class DeadMotor:
    """Hand that its guard stops when it is closed: a finger is not open, as that of a dead motor after a homing."""

    def __init__(self, opened):
        self._opened = opened

    @contextmanager
    def __call__(self, spec):
        with self._opened(spec) as target:
            yield target
        raise SafetyStopError("SWITCH THE HAND'S SUPPLY OFF: ring is 38% closed")


def test_a_hand_that_its_guard_stops_gets_its_name_and_the_stop_ends_the_setup(owned, monkeypatch):
    """Its validation, which finds the part, needs the name."""
    owner, whole = Owner("right"), setup.set_up
    monkeypatch.setattr(setup, "set_up", lambda asker, port, opened: whole(asker, port, DeadMotor(opened)))
    with pytest.raises(SafetyStopError, match="SUPPLY OFF"):
        owned(owner, "0.2.0", "right")
    assert read_hands(setup.Path(FILE))["bench"]["firmware"] == "0.2.0"
    assert owner.told[-1] == "next: aero-hil validate --hil bench"
    assert not any("Each channel moves" in question for question in owner.asked)


@pytest.mark.parametrize("port", ["nobody", "emulated", "", "file.toml"])
def test_what_is_no_port_is_refused_before_the_first_question(port, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    ran = CliRunner().invoke(main, ["setup", "--hil", port])
    assert (ran.exit_code, ran.output.count("\n")) == (2, 1)
    assert "Name of this hand" not in ran.output
