"""A headless Chromium of the machine, driven by Playwright; without one every test here fails, in `tox -e browser`."""

import contextlib
import shutil

import pytest
from playwright.sync_api import expect, sync_playwright

PATIENCE_S = 60.0
expect.set_options(timeout=1e3 * PATIENCE_S)
FLAGS = (
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--disable-component-update",
    "--disable-background-networking", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)  # fmt: skip
"""It draws without a graphics card and finds no machine but this one."""


@pytest.fixture(scope="session")
def chromium():
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None:
        pytest.fail("there is no Chromium on PATH; apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=FLAGS, chromium_sandbox=False)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def opened(chromium):
    """Returns a context manager that opens an address in a tab of its own and notes errors and requests."""

    @contextlib.contextmanager
    def open_tab(url, *, width=1280, height=800):
        context = chromium.new_context(viewport={"width": width, "height": height})
        context.set_default_timeout(1e3 * PATIENCE_S)
        tab = context.new_page()
        tab.errors, tab.requests = [], []
        tab.on("pageerror", lambda error: tab.errors.append(str(error)))
        tab.on("requestfailed", lambda request: tab.errors.append(request.url))
        tab.on("request", lambda request: tab.requests.append(request.url))
        tab.on("websocket", lambda socket: tab.requests.append(socket.url))
        tab.goto(url)
        try:
            yield tab
        finally:
            context.close()

    return open_tab
