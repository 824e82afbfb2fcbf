"""Photographs of pages: the report on a hand whose ring motor is dead, and the page of `--view`.

Chromium renders the pages that `aero-hil validate` writes and serves.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from aero.exit_code import Exit
from figures.inputs import ROOT

DOCS = ROOT / "docs"
PICTURE = DOCS / "failing_report.png"
VALIDATE = ("-m", "aero_hil", "validate", "--fault", "motor_dead:ring", "--out")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
VIEW = DOCS / "view.png"
VALIDATE_SEEN = ("-m", "aero_hil", "validate", "--view", "--out")
LONGEST_S = 300.0
"""Patience with the run on a busy computer, s."""
FIST_S = "24.5"
"""Moment of the photographed page, s: all digits are closed."""
SIZE_PX = 1100, 966
VIEW_PX = 1280, 975
COLOURS = 64
"""Of the palette, which keeps the file below 50 kB."""


def _browser() -> str:
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        raise RuntimeError(f"no browser to render with; install one of {', '.join(BROWSERS)}")
    return found


def write_view() -> None:
    """Validate a hand with `--view`, and photograph its page when the hand is a fist."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - tests and samples have none

    width, height = VIEW_PX
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with (
        TemporaryDirectory() as folder,
        subprocess.Popen(
            (sys.executable, *VALIDATE_SEEN, folder), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
            text=True,
        ) as run,
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=_browser(), args=flags) as chromium,
    ):  # fmt: skip
        assert run.stderr is not None
        url = next(line.split()[1] for line in run.stderr if line.startswith("view "))
        page = chromium.new_page(viewport={"width": width, "height": height})
        page.goto(url)
        page.get_by_text("the run has ended").wait_for(timeout=1e3 * LONGEST_S)
        page.get_by_text("WebGL is running").locator("xpath=ancestor::*[@role='alert']//button").click()
        time = page.get_by_role("textbox", name="Time, s")
        time.fill(FIST_S)
        time.press("Enter")
        page.get_by_text("paused").wait_for()
        page.wait_for_timeout(1000)
        page.screenshot(path=VIEW)


def write_report() -> None:
    """Validate the hand, render its report and write the picture."""
    browser = _browser()
    with TemporaryDirectory() as folder:
        done = subprocess.run((sys.executable, *VALIDATE, folder), check=False)
        if done.returncode != Exit.OUT_OF_LIMITS:
            raise RuntimeError(f"the validation ended with {done.returncode}, not {int(Exit.OUT_OF_LIMITS)}")
        shot = Path(folder) / "shot.png"
        window = f"--window-size={SIZE_PX[0]},{SIZE_PX[1]}"
        report = Path(folder, "report.html").as_uri()
        options = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=10000")
        subprocess.run((browser, *options, window, f"--screenshot={shot}", report), check=True, capture_output=True)
        with Image.open(shot) as picture:
            picture.convert("RGB").quantize(COLOURS).save(PICTURE, optimize=True)
