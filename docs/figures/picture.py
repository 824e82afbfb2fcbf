"""Drawing of docs/failing_report.png, the top of the report on a hand whose ring motor is dead.

Chromium renders the page that `aero-hil validate --fault motor_dead:ring` writes.
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

PICTURE = ROOT / "docs" / "failing_report.png"
VALIDATE = ("-m", "aero_hil", "validate", "--fault", "motor_dead:ring", "--out")
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SIZE_PX = 1100, 953
COLOURS = 64
"""Of the palette, which keeps the file below 50 kB."""


def write_report() -> None:
    """Validate the hand, render its report and write the picture."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise RuntimeError(f"no browser to render with; install one of {', '.join(BROWSERS)}")
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
