"""The page in a headless browser, without any network: the hand is drawn, the numbers are told, time can be moved."""

import time

import numpy as np
import pytest
from browser import CHROMIUM, opened
from matplotlib import image

from aero.channels import Joint
from hil.view.frame import Heading, Note, Verdicts, ViewFrame
from hil.view.scene import SLACK, TAUT
from hil.view.web_page import Page

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")]

LOADED = "document.querySelector('canvas') && document.body.innerText.includes('measured')"
SHOWS = "document.body.innerText.includes({!r})"


def closing(seconds):
    """A hand that closes; its index cable is slack."""
    for i in range(30 * seconds):
        share = i / (30 * seconds)
        loose = np.array([2e-3, 0.0, 0.0, 0.0, np.nan, 0.0, 0.0])
        angles = np.full(7, 3.0 * share)
        yield ViewFrame(
            i / 30, np.full(len(Joint), share), np.full(len(Joint), share), angles, angles,
            currents=np.full(7, 0.5), temperatures=np.full(7, 41.0), tensions=np.full(7, 6.5), loose=loose,
        )  # fmt: skip


def drawn(tab, path):
    """What is beside the panel, (h, w, 3) from 0 to 1."""
    tab.picture(path)
    return image.imread(path)[:, : 1280 - 500, :3]


def share_of(picture, colour):
    """The part of a picture that has about this colour's hue."""
    wanted = np.array(colour) / 255.0
    return float(np.mean(np.abs(picture - wanted).max(axis=2) < 0.12))


def faded_in(page, tab, path):
    """The scene once two pictures in a row are the same; viser lets things appear slowly."""
    before, now = np.zeros(()), drawn(tab, path)
    while not np.array_equal(before, now):
        for _ in range(10):
            keep_up_until(page, tab, "true")
        before, now = now, drawn(tab, path)
    return now


@pytest.fixture
def page():
    made = Page(Heading("A hand that closes", "right", live=False))
    for frame in closing(seconds=4):
        made.show(frame)
    made.show(Note(3.0, "an event with <b>markup</b>"))
    made.show(Verdicts(59, ("ring: tracking_rms is 3.2 mm, should be at most 0.9 mm",)))
    yield made
    made.close()


def keep_up_until(page, tab, condition):
    """Serve the page, as its loop does, until a condition holds in the browser."""
    began = time.monotonic()
    while time.monotonic() - began < 60.0:
        page.tick()
        if tab.evaluate(f"Boolean({condition})"):
            return
    pytest.fail(f"not within a minute: {condition}; {tab.evaluate('document.body.innerText')[:500]} {tab.errors}")


def click(tab, button):
    tab.evaluate(f"[...document.querySelectorAll('button')].find(one => one.innerText == '{button}').click()")


def test_a_recording_is_seen_and_played(page, tmp_path):
    with opened(page.url, tmp_path) as tab:
        keep_up_until(page, tab, LOADED)
        for text in ("A hand that closes", "41 °C", "0.50 A", "2.0 mm", "6.5 N", "slack cable", "1 failed", "3.2 mm"):
            keep_up_until(page, tab, SHOWS.format(text))
        keep_up_until(page, tab, SHOWS.format("an event with <b>markup</b>"))
        keep_up_until(page, tab, SHOWS.format("paused"))  # it plays when it is opened, to its end
        closed = faded_in(page, tab, tmp_path / "closed.png")
        assert share_of(closed, TAUT) > 1e-3
        assert share_of(closed, SLACK) > 1e-4
        assert np.mean(closed.min(axis=2) < 0.9) > 0.05  # of the half that is the scene, the hand

        click(tab, "Play")
        keep_up_until(page, tab, f"!{SHOWS.format('an event')}")
        click(tab, "Pause")
        keep_up_until(page, tab, SHOWS.format("paused"))
        before = faded_in(page, tab, tmp_path / "before.png")
        assert np.mean(np.abs(closed - before).max(axis=2) > 0.1) > 0.01

        assert not tab.errors
        asked_for = {url for url in tab.requests if not url.startswith(("data:", "blob:"))}
        assert asked_for == {page.url}
