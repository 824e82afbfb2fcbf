"""The page of `emulate --view` as a person uses it, at the width of a desk and of a phone."""

import re
import signal
import subprocess
import sys

import pytest
from playwright.sync_api import expect

from aero import AeroHand, Channel
from hil.emulated.faults.acts import ACTS
from hil.emulated.hands_on import COMMAND

WIDTHS = (1280, 400)


@pytest.fixture(params=WIDTHS, ids=[f"{width} px" for width in WIDTHS])
def served(request, opened):
    """A tab with the page, and the port of its hand."""
    command = [sys.executable, "-m", "hil.cli", "emulate", "--view", "--seed", "3"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL}
    with subprocess.Popen(command, text=True, **pipes) as process:
        try:
            url = process.stderr.readline().removeprefix("view ").strip()
            port = process.stdout.readline().removeprefix("ready ").strip()
            with opened(url, width=request.param, height=900) as tab:
                tab.get_by_text("Do to the hand").wait_for()
                yield tab, port
                assert not tab.errors
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate()
    assert process.returncode == 0


def codes_of(port):
    with AeroHand.open_unguarded(port) as hand:
        return hand.read_codes() / 655.35


def slide(tab, name, percent):
    """Move a slider, and wait until the page's table says so."""
    commanded = tab.get_by_role("row", name=re.compile(f"^{name} ")).get_by_role("cell").nth(1)
    before = commanded.inner_text()
    tab.get_by_role("textbox", name=name, exact=True).fill(str(percent))
    expect(commanded).not_to_have_text(before)


def said(tab, pattern):
    tab.get_by_text(re.compile(pattern)).first.wait_for()


def test_one_slider_leaves_the_other_channels(served):
    tab, port = served
    for name, percent in (("Index", 70), ("Middle", 60), ("Ring", 50)):
        slide(tab, name, percent)
    slide(tab, "Ring", 20)
    expected = pytest.approx([70, 60, 20], abs=3)
    for _ in range(40):
        tab.wait_for_timeout(500)
        codes = codes_of(port)[[Channel.INDEX, Channel.MIDDLE, Channel.RING]]
        if codes == expected:
            break
    assert codes == expected


def test_every_slider_has_a_name_for_a_screen_reader(served):
    tab, _ = served
    names = [one.get_attribute("aria-label") for one in tab.get_by_role("slider").all()]
    assert len(names) >= 8
    assert all(names)
    assert len(set(names)) == len(names)


def test_a_fault_is_picked_from_a_list(served):
    tab, _ = served
    tab.get_by_role("combobox", name="Fault", exact=True).click()
    tab.get_by_role("option", name="motor_dead", exact=True).click()
    tab.get_by_text("a motor gets no current").wait_for()
    tab.get_by_role("combobox", name="Channel", exact=True).first.click()
    tab.get_by_role("option", name="ring", exact=True).first.click()
    tab.get_by_role("button", name="Inject").click()
    said(tab, "injected motor_dead:ring")
    tab.get_by_role("button", name="Clear").click()
    said(tab, "cleared motor_dead:ring")


def test_enter_runs_what_is_typed_also_in_a_hurry(served):
    """viser's page sends one message in 50 ms at most, and drops those before the last."""
    tab, _ = served
    words = tab.get_by_role("textbox", name="Words")
    tab.get_by_role("textbox", name="Ring", exact=True).fill("20")
    words.fill("voltage")
    words.press("Enter")
    said(tab, r"measured [\d.]+ V")
    expect(words).to_have_value("")
    words.press_sequentially("look ring\nmode\ncommand ring 40 50\n")
    said(tab, "usage: command CHANNEL PERCENT")
    expect(words).to_have_value("")


def test_help_shows_every_act(served):
    tab, _ = served
    words = tab.get_by_role("textbox", name="Words")
    words.press_sequentially("help\n")
    said(tab, "inject FAULT")
    shown = tab.inner_text("body")
    assert [name for name in (*ACTS, COMMAND) if name not in shown] == []
