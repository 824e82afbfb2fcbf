"""A name in `hands.toml` stands for a port and what is known of the hand there; mistakes are one line."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

import hil
from aero.safety import Region, Thresholds
from hil.cli import main
from hil.cli.doctor.ports import Answers
from hil.targets.hands_file import NAME, PORT, add_hand, fields_of, read_hands

pytest_plugins = ["pytester"]

BENCH = """\
# the bench by the window
[bench-left]
port = "/dev/ttyACM7"
firmware = "0.1.5"
side = "left"
twin = "mine.toml"
baseline = "known"
thresholds = { current_a = 3.5 }
[[bench-left.forbidden]]
thumb_abduction = { below = 0.6 }
ring = { above = 0.3 }
"""
MISTAKES = {
    "no TOML": ("[bench-left\n", r"not TOML.*line 1"),
    "another key": (
        BENCH.replace("firmware", "firmwear"),
        r"\[bench-left\]: unknown key `firmwear`; did you mean `firmware`",
    ),
    "another side": (BENCH.replace('"left"', '"third"'), r"\[bench-left\].side is one of right, left, not 'third'"),
    "a number": (BENCH.replace('"0.1.5"', "0.1"), r"\[bench-left\].firmware: expected text, got `float`"),
    "a threshold's name": (
        BENCH.replace("current_a", "curent_a"),
        r"thresholds: unknown key `curent_a`; did you .*`current_a`",
    ),
    "a threshold of nothing": (
        BENCH.replace("3.5", "0"),
        r"\[bench-left\].thresholds: safety threshold current_a: expected a pos",
    ),
    "no table": (
        BENCH.replace("{ current_a = 3.5 }", "3.5"),
        r"\[bench-left\].thresholds: expected a table, got `float`",
    ),
    "a region of one channel": (
        BENCH.replace("ring", "# ring"),
        r"\[bench-left\].forbidden: a forbidden region has two channels, got thumb_abduction",
    ),
    "a region's edge": (BENCH.replace("0.6", "60"), r"\[bench-left\].forbidden: .*between 0 and 1"),
    "an empty port": (BENCH.replace("/dev/ttyACM7", ""), r"\[bench-left\]: `port` is empty"),
    "another firmware": (BENCH.replace("0.1.5", "9.9"), r"\[bench-left\]: .*9\.9.*0\.2\.0"),
    "no port": (BENCH.replace("port", "# port"), r"\[bench-left\]: missing key `port`"),
    "outside a table": ('port = "COM3"\n', r"`port` stands outside a table"),
    "a port as name": ('[COM3]\nport = "COM3"\n', r"\[COM3\]: a name is made of"),
}


@pytest.fixture(autouse=True)
def folders(tmp_path, monkeypatch):
    """An empty working folder, and an empty folder of the user's configuration."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("APPDATA", str(tmp_path / "config"))
    (tmp_path / "config" / "aero-hil").mkdir(parents=True)
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "work", tmp_path / "config" / "aero-hil"


def test_a_name_brings_all_that_the_file_says(folders):
    work, _ = folders
    (work / "hands.toml").write_text(BENCH)
    said = {"port": "/dev/ttyACM7", "hand_id": "bench-left", "firmware": "0.1.5", "side": "left"}
    region = Region.of({"thumb_abduction": {"below": 0.6}, "ring": {"above": 0.3}})
    limits = Thresholds(current_a=3.5, forbidden=(region,))
    known = {"twin": "mine.toml", "baseline": Path("known"), "thresholds": limits}
    assert fields_of("bench-left") == said | known


def test_an_unknown_name_offers_the_nearest(folders):
    (folders[0] / "hands.toml").write_text(BENCH)
    with pytest.raises(ValueError, match=r"'bench-lef'; did you mean `bench-left`.*/dev/ttyACM0"):
        fields_of("bench-lef")
    with pytest.raises(ValueError, match="did you mean `emulated`"):
        hil.open_port("emulatd")


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_that_says_where_and_what_is_allowed(folders, mistake):
    text, said = MISTAKES[mistake]
    (folders[0] / "hands.toml").write_text(text)
    result = CliRunner().invoke(main, ["validate", "--hil", "bench-left", "--dry-run"])
    assert result.exit_code == 2
    (line,) = result.output.splitlines()
    assert re.search(said, line), line
    assert "hands.toml" in line


def test_the_command_line_counts_over_the_file(folders):
    (folders[0] / "hands.toml").write_text('[soft]\nport = "emulated"\nfirmware = "0.1.5"\nside = "left"\n')
    run = CliRunner().invoke
    dry = ["validate", "--hil", "soft", "--dry-run", "--zeros", "ideal"]
    said = run(main, dry).output
    assert "left hand soft on emulated, firmware 0.1.5" in " ".join(said.split())
    said = run(main, [*dry, "--firmware", "pre", "--side", "right"]).output
    assert "right hand soft on emulated, firmware pre" in " ".join(said.split())


def test_pytest_takes_the_name_too(folders, pytester):
    pytester.makefile(".toml", hands='[soft]\nport = "emulated"\nfirmware = "0.1.5"\nside = "left"\n')
    pytester.makepyfile(
        "def test_hand(aero_target):\n    assert (aero_target.firmware, aero_target.side) == ('0.1.5', 'left')"
    )
    result = pytester.runpytest("--hil=soft", "-p", "no:cacheprovider")
    result.stdout.fnmatch_lines(["*left hand soft on emulated, firmware 0.1.5*", "*1 passed*"])
    assert pytester.runpytest("--hil=sofd").ret == pytest.ExitCode.USAGE_ERROR


@given(
    name=st.from_regex(NAME, fullmatch=True).filter(
        lambda name: not PORT.search(name) and name not in ("emulated", "pty")
    ),
    port=st.text(st.characters(exclude_categories=["Cc", "Cs"]), min_size=1),
    versions=st.lists(st.sampled_from(["pre", "0.1.5", "0.2.0"]), unique=True),
)
def test_what_is_added_is_read_again_and_the_rest_stays(tmp_path_factory, name, port, versions):
    path = tmp_path_factory.mktemp("hands") / "hands.toml"
    path.write_text(BENCH)
    if name == "bench-left":
        return
    add_hand(name, port, versions, path)
    hand = read_hands(path)[name]
    assert (hand["port"], hand.get("firmware")) == (port, versions[0] if len(versions) == 1 else None)
    assert path.read_text(encoding="utf-8").startswith(BENCH)
    with pytest.raises(ValueError, match="already"):
        add_hand(name, "COM9", [], path)


def test_doctor_saves_a_hand_that_answers_and_never_another_s_name(folders, monkeypatch):
    answers = Answers((20_000,) * 7, knows_limits=True, knows_calibrate_mid=True, boot_text="")
    monkeypatch.setattr("hil.cli.doctor.ports.ask", lambda _port: answers)
    (folders[0] / "hands.toml").write_text(BENCH)
    run = CliRunner().invoke
    refused = run(main, ["doctor", "--hil", "/dev/ttyACM3", "--save", "bench-left"])
    assert refused.exit_code == 2
    assert "[bench-left] already" in refused.output
    assert run(main, ["doctor", "--save", "x"]).exit_code == 2
    said = run(main, ["doctor", "--hil", "/dev/ttyACM3", "--save", "bench-right"]).output
    assert "--hil bench-right" in said
    assert fields_of("bench-right")["port"] == "/dev/ttyACM3"
    assert (folders[0] / "hands.toml").read_text().startswith(BENCH)
