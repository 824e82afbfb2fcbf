"""A headless Chromium that opens a page, over its own debugging protocol."""

import base64
import contextlib
import json
import os
import shutil
import subprocess
import threading

from websockets.sync.client import connect

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PATIENCE_S = 60.0
FLAGS = (
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--remote-debugging-port=0", "about:blank",
)  # fmt: skip
"""It draws without a graphics card and finds no machine but this one."""


class Tab:
    """One open page."""

    def __init__(self, socket):
        self._socket = socket
        self._asked = 0
        self.errors = []
        """What the page could not load or compute."""
        self.requests = []
        """Addresses that the page asked for."""

    def ask(self, method, **parameters):
        self._asked += 1
        self._socket.send(json.dumps({"id": self._asked, "method": method, "params": parameters}))
        while True:
            said = json.loads(self._socket.recv(PATIENCE_S))
            if said.get("id") == self._asked:
                assert "error" not in said, said
                return said["result"]
            self._note(said)

    def evaluate(self, expression):
        result = self.ask("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def picture(self, path):
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"]))

    def _note(self, said):
        if said["method"] == "Network.requestWillBeSent":
            self.requests.append(said["params"]["request"]["url"])
        elif said["method"] == "Network.webSocketCreated":
            self.requests.append(said["params"]["url"])
        elif said["method"] in ("Network.loadingFailed", "Runtime.exceptionThrown"):
            self.errors.append(said["params"])


@contextlib.contextmanager
def opened(url, folder, *, width=1280, height=800):
    """Open a page in a browser with a profile of its own below `folder`."""
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={folder / 'profile'}", f"--window-size={width},{height}"]
    environment = {**os.environ, "HOME": str(folder)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        try:
            address = next(line.split()[-1] for line in process.stderr if "DevTools listening on" in line)
            threading.Thread(target=process.stderr.read, daemon=True).start()
            port = address.split(":")[2].split("/")[0]
            with connect(address, max_size=None) as whole:
                browser = Tab(whole)
                target = browser.ask("Target.createTarget", url="about:blank")["targetId"]
            with connect(f"ws://127.0.0.1:{port}/devtools/page/{target}", max_size=None) as socket:
                tab = Tab(socket)
                for domain in ("Network", "Runtime", "Page"):
                    tab.ask(f"{domain}.enable")
                size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
                tab.ask("Emulation.setDeviceMetricsOverride", **size)
                tab.ask("Page.navigate", url=url)
                yield tab
        finally:
            process.terminate()
            process.wait()
