"""Whole cases on a guarded port, gone through by the buttons of the page, at the width of a desk and of a phone."""

import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from playwright.sync_api import TimeoutError, expect
from port_owner import first_run

from aero.exit_code import Exit

PATIENCE_S = 400.0
CLICKED_MS = 3000
HIL = [sys.executable, "-P", "-m", "hil.cli"]
SHORT = ("--only", "presence", "--only", "audit", "--only", "excursion")


@contextmanager
def a_hand(folder, *faults):
    """An emulated hand on a port; yields what does an act to it."""
    command = [*HIL, "emulate", "--prompt", "--link", str(folder / "hand"), "--seed", "3"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([*command, *(f"--fault={fault}" for fault in faults)], text=True, **pipes) as served:
        assert served.stdout.readline().startswith("ready ")

        def act(words):
            served.stdin.write(f"{words}\n")
            served.stdin.flush()

        try:
            yield act
        finally:
            served.send_signal(signal.SIGINT)


@contextmanager
def diagnosed(folder, *options):
    """`validate`, then `diagnose --view`; yields the program and the page's address."""
    hand = ["--hil", str(folder / "hand")]
    found, said = first_run(folder / "run", folder / "hand", *SHORT)
    assert found in (Exit.OUT_OF_LIMITS, Exit.STOPPED), said
    command = [*HIL, "diagnose", str(folder / "run"), *hand, "--view", *options]
    with subprocess.Popen(
        command, cwd=folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as program:
        try:
            yield program, program.stderr.readline().removeprefix("view ").strip()
        finally:
            program.kill()


def buttons(tab):
    """The labels of all answers that can be given now."""
    return [text for one in tab.locator("form button:visible").all() if (text := one.inner_text().strip())][1:]


def click(tab, name):
    tab.get_by_role("button", name=name, exact=True).click()


def click_if_there(tab, name):
    """Click a button; return False if a page that was busy has removed it meanwhile."""
    try:
        tab.get_by_role("button", name=name, exact=True).click(timeout=CLICKED_MS)
    except TimeoutError:
        return False
    return True


def answer(tab):
    """Answer what is asked, but for what lets the hand move; return the buttons."""
    now = buttons(tab)
    if "No" in now:
        click_if_there(tab, "No")
    elif "Not sure" in now:
        moved = re.search(r"has moved the (\w+) finger", tab.inner_text("body"))
        click_if_there(tab, f"{moved[1] if moved else 'middle'} finger".capitalize())
    elif again := {"Repeat", "All is connected"}.intersection(now):  # a busy computer, which also runs the hand
        click_if_there(tab, again.pop())
    elif (note := tab.get_by_role("textbox", name="Note, then Enter")).is_visible():
        note.press_sequentially("as the neighbour\n")
        expect(note).to_be_hidden()
        return ["Note"]
    return now


def until_done(tab):
    """Answer until the hand is about to move."""
    late = time.monotonic() + PATIENCE_S
    while "Done" not in answer(tab):
        assert time.monotonic() < late, tab.inner_text("body")
        tab.wait_for_timeout(300)


def gone_through(tab, act):
    """Answer until the case is closed, as the owner of a hand does; return its conclusion and the buttons seen."""
    late, seen, exchanged = time.monotonic() + PATIENCE_S, set(), False
    while time.monotonic() < late:
        now = answer(tab)
        shown = tab.inner_text("body")  # after the buttons: what they are about was shown before them
        seen.update(now)
        if closed := re.search(r".*Then validate again.*", shown):
            return closed[0], seen
        if "Done" in now:
            step = re.search(r"Next step.*", shown)[0]
            if "Exchange it with" in step and not exchanged:
                assert tab.get_by_role("img", name="Touch: Ring").count()
                act("exchange_servos ring middle")
                exchanged = True
            if click_if_there(tab, "Done"):
                # a busy page still shows the button of the step that is done
                expect(tab.get_by_role("button", name="Done", exact=True)).to_be_hidden()
        tab.wait_for_timeout(300)
    raise AssertionError(tab.inner_text("body"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("width", "faults", "convicted"),
    [(1280, ["motor_dead:ring"], "Servo of the ring finger"), (400, ["gear_jammed:ring"], "Servo of the ring finger")],
)
def test_a_whole_case_by_buttons(width, faults, convicted, opened, tmp_path):
    with a_hand(tmp_path, *faults) as act, diagnosed(tmp_path) as (program, url):
        with opened(url, width=width) as tab:
            conclusion, seen = gone_through(tab, act)
            tab.screenshot(path=tmp_path / f"closed-{width}.png")
            assert not tab.errors
        assert convicted in conclusion
        assert {"Done", "Note", "Yes", "No"} <= seen
        assert "(on the page)" in program.communicate(timeout=PATIENCE_S)[0]


def test_closing_the_page_and_opening_two_changes_nothing_and_a_stale_click_answers_nothing(opened, tmp_path):
    with a_hand(tmp_path, "cable_snapped:ring"), diagnosed(tmp_path) as (program, url):
        with opened(url) as tab:
            until_done(tab)
        with pytest.raises(subprocess.TimeoutExpired):
            program.wait(5.0)
        origin = url.rsplit("/", 1)[0]
        with opened(url, width=400) as first, opened(url) as second, opened(origin) as foreign:
            assert "has a token" in foreign.inner_text("body")
            for tab in (first, second):
                tab.get_by_role("button", name="Done", exact=True).wait_for()
            click(first, "Done")
            second.get_by_text(re.compile("s of hand time left")).wait_for()
            assert buttons(second) == []
            click(second, "Stop: open the hand")
            out, errors = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 130, errors
    assert "the case is interrupted" in out
    assert "SWITCH THE HAND" not in errors


def test_buttons_are_large_enough_for_a_thumb_and_stop_stays_in_sight(opened, tmp_path):
    with a_hand(tmp_path, "motor_dead:ring"), diagnosed(tmp_path) as (_, url), opened(url, width=400) as tab:
        until_done(tab)
        done = tab.get_by_role("button", name="Done", exact=True)
        assert done.bounding_box()["height"] >= 44  # 44 CSS px, WCAG 2.1 target size
        tab.get_by_text("Plots").last.scroll_into_view_if_needed()
        tab.wait_for_timeout(500)
        stop = tab.get_by_role("button", name="Stop: open the hand").bounding_box()
        assert 0 <= stop["y"] <= 800 - stop["height"]
