"""`aero-hil view --hil PORT`: what it shows, and the bytes that it sends, directly and through a guard."""

import sys

import pytest
from click.testing import CliRunner
from served_command import commands, serving

from aero.channels import Channel
from aero.protocol import READINGS
from hil.cli import live_view, main
from hil.dialogue.terminal import console
from hil.recordings.mcap_file import read_recording

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the end of a client shows on Linux only")
TABLES = 10


@pytest.fixture
def shown(monkeypatch):
    """Show a port for some tables without a page, then press Ctrl-C; return the last table as text, and the ages."""

    def show(port):
        texts, ages = [], []
        drawn = live_view._table

        def table(target, values, trouble):
            screen, one = console(width=100), drawn(target, values, trouble)
            with screen.capture() as capture:
                screen.print(one)
            texts.append(capture.get())
            ages.append(target.hand.reading_age_s)
            if len(texts) == TABLES:
                raise KeyboardInterrupt
            return one

        monkeypatch.setattr(live_view, "_table", table)
        monkeypatch.setattr(live_view, "find_spec", lambda _name: None)
        ran = CliRunner().invoke(main, ["view", "--hil", str(port)])
        monkeypatch.undo()
        assert ran.exit_code == 0, ran.output
        return texts[-1]

    return show


def test_a_live_table_shows_every_channel_and_commands_nothing(shown, tmp_path):
    with serving("emulate", "--link", "hand", "--record", "hand.mcap", folder=tmp_path):
        bare = shown(tmp_path / "hand")
        with serving("guard", "hand", "--link", "guarded", folder=tmp_path):
            guarded = shown(tmp_path / "guarded")
    for table in (bare, guarded):
        assert [channel for channel in Channel if f"{channel.label} " not in table] == []
        assert table.count(" A ") == table.count("°C") == len(Channel)
        assert "-0.0" not in table
        assert "nothing is commanded" in table
    asked = [record.data[0] for record in read_recording(tmp_path / "hand.mcap").wire if record.direction == "to_hand"]
    assert len(asked) > 2 * 3 * TABLES
    assert set(asked) <= set(READINGS)
    assert commands(tmp_path / "hand.mcap") == []


def test_a_view_needs_one_thing_to_show():
    for words in ((), ("a.mcap", "--hil", "x")):
        assert CliRunner().invoke(main, ["view", *words]).exit_code == 2


def test_a_port_that_another_program_drives_is_left_alone(monkeypatch):
    monkeypatch.setattr(live_view, "holders", lambda _port: ("robot (12)",))
    ran = CliRunner().invoke(main, ["view", "--hil", "/dev/ttyACM7"])
    assert ran.exit_code == 3
    assert "robot (12)" in ran.output
    assert "aero-hil guard /dev/ttyACM7 --view" in ran.output
