"""The page of a recording, without any network: the hand is drawn, the numbers are shown, time can be moved."""

import io
import time

import numpy as np
import pytest
from matplotlib import image

from aero.channels import Joint
from hil.view.frame import Heading, Note, Verdicts, ViewFrame
from hil.view.web_page import PANEL_PX, Page

WIDTH_PX, HEIGHT_PX = PANEL_PX + 420, 400
"""A small scene, because Chromium draws it without a graphics card."""
PATIENCE_S = 120.0
HIDE_WARNING = ".mantine-Notifications-root { display: none }"
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
    until(page, lambda: text in tab.inner_text("body"), text)


def is_red(picture):
    return picture[..., 0] - picture[..., 1:].max(axis=2) > 0.25


def is_blue(picture):
    return picture[..., 2] - picture[..., 0] > 0.25


def test_a_recording_is_seen_and_played(page, opened):
    def cables():
        """The scene beside the panel, (h, w, 3) from 0 to 1, when it has cables; viser lets things appear slowly."""
        seen = []

        def drawn():
            whole = image.imread(io.BytesIO(tab.screenshot()), format="png")
            seen.append(whole[:, : WIDTH_PX - PANEL_PX, :3])
            return min(is_red(seen[-1]).sum(), is_blue(seen[-1]).sum()) > 20

        until(page, drawn, "taut and slack cables")
        return seen[-1]

    with opened(page.url, width=WIDTH_PX, height=HEIGHT_PX) as tab:
        until(page, lambda: tab.locator("canvas").count(), "the scene")
        tab.add_style_tag(content=HIDE_WARNING)
        until_shown(page, tab, "an event")
        until_shown(page, tab, "paused")  # it plays when it is opened, to its end
        told = tab.inner_text("body")
        for text in ("A hand that closes", "1.00 s", "41 °C", "0.50 A", "2.0 mm", "6.5 N", "slack cable"):
            assert text in told
        for text in ("1 failed", "3.2 mm", "an event with <b>markup</b>"):
            assert text in told
        closed = cables()
        assert np.mean(closed.min(axis=2) < 0.9) > 0.05

        tab.get_by_label("Time, s").last.fill("0.2")
        until_shown(page, tab, "0.20 s of")
        assert "an event" not in tab.inner_text("body")
        assert np.mean(np.abs(closed - cables()).max(axis=2) > 0.1) > 0.01

        tab.get_by_role("button", name="Play").click()
        until_shown(page, tab, "1.00 s of")

        assert not tab.errors
        socket = page.url.replace("http:", "ws:")
        assert {url for url in tab.requests if not url.startswith(("data:", "blob:"))} <= {page.url, socket}
