"""The page in a headless browser, without any network: the hand is drawn, the numbers are shown, time can be moved."""

import time

import numpy as np
import pytest
from browser import CHROMIUM, opened
from matplotlib import image

from aero.channels import Joint
from hil.view.frame import Heading, Note, Verdicts, ViewFrame
from hil.view.web_page import PANEL_PX, Page

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")]

WIDTH_PX, HEIGHT_PX = PANEL_PX + 420, 400
"""A small scene, because Chromium draws it without a graphics card."""
PATIENCE_S = 120.0
SHOWS = "document.body.innerText.includes({!r})"
TIME_INPUT = "[...document.querySelectorAll('input')].find(one => /^[0-9.]+$/.test(one.value))"
HIDE_WARNING = (
    "document.head.appendChild(document.createElement('style')).textContent ="
    " '.mantine-Notifications-root { display: none }'"
)
"""viser warns of slow drawing over the scene, in orange."""


def closing():
    """A second of a hand that closes; its index cable is slack."""
    for i in range(31):
        t = i / 30
        loose = np.array([2e-3, 0.0, 0.0, 0.0, np.nan, 0.0, 0.0])
        joints, angles = np.full(len(Joint), t), np.full(7, 3.0 * t)
        yield ViewFrame(
            t, joints, joints, angles, angles,
            currents=np.full(7, 0.5), temperatures=np.full(7, 41.0), tensions=np.full(7, 6.5), loose=loose,
        )  # fmt: skip


@pytest.fixture
def page():
    made = Page(Heading("A hand that closes", "right", live=False))
    for frame in closing():
        made.show(frame)
    made.show(Note(0.7, "an event with <b>markup</b>"))
    made.show(Verdicts(59, ("ring: tracking_rms is 3.2 mm, should be at most 0.9 mm",)))
    yield made
    made.close()


def until(page, holds, what):
    """Serve the page, as its loop does, until something holds."""
    began = time.monotonic()
    while not holds():
        assert time.monotonic() - began < PATIENCE_S, what
        page.tick()


def until_shown(page, tab, text):
    until(page, lambda: tab.evaluate(SHOWS.format(text)), text)


def scene_of(tab, path):
    """What is beside the panel, (h, w, 3) from 0 to 1."""
    tab.picture(path)
    return image.imread(path)[:, : WIDTH_PX - PANEL_PX, :3]


def is_red(picture):
    return picture[..., 0] - picture[..., 1:].max(axis=2) > 0.25


def is_blue(picture):
    return picture[..., 2] - picture[..., 0] > 0.25


def test_a_recording_is_seen_and_played(page, tmp_path):
    def cables(name):
        """The scene when it has cables; viser lets things appear slowly."""
        seen = []

        def drawn():
            seen.append(scene_of(tab, tmp_path / name))
            return min(is_red(seen[-1]).sum(), is_blue(seen[-1]).sum()) > 20

        until(page, drawn, "taut and slack cables")
        return seen[-1]

    with opened(page.url, tmp_path, width=WIDTH_PX, height=HEIGHT_PX) as tab:
        until(page, lambda: tab.evaluate("Boolean(document.querySelector('canvas'))"), "the scene")
        tab.evaluate(HIDE_WARNING)
        until_shown(page, tab, "an event")
        until_shown(page, tab, "paused")  # it plays when it is opened, to its end
        told = tab.evaluate("document.body.innerText")
        for text in ("A hand that closes", "1.00 s", "41 °C", "0.50 A", "2.0 mm", "6.5 N", "slack cable"):
            assert text in told
        for text in ("1 failed", "3.2 mm", "an event with <b>markup</b>"):
            assert text in told
        closed = cables("closed.png")
        assert np.mean(closed.min(axis=2) < 0.9) > 0.05

        tab.evaluate(f"{TIME_INPUT}.focus(); {TIME_INPUT}.select()")
        tab.ask("Input.insertText", text="0.2")
        until_shown(page, tab, "0.20 s of")
        assert not tab.evaluate(SHOWS.format("an event"))
        assert np.mean(np.abs(closed - cables("open.png")).max(axis=2) > 0.1) > 0.01

        tab.evaluate("[...document.querySelectorAll('button')].find(one => one.innerText == 'Play').click()")
        until_shown(page, tab, "1.00 s of")

        assert not tab.errors
        asked_for = {url for url in tab.requests if not url.startswith(("data:", "blob:"))}
        assert asked_for == {page.url}
