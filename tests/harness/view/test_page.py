"""The page: who gets it, what it says, and that the hand's program never depends on it."""

import asyncio
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from aero.channels import Channel
from aero.clock import WallClock
from hil.emulated.any_hand import open_target
from hil.recordings.recorder import Recorder
from hil.view import feed as feed_module
from hil.view.feed import Feed
from hil.view.frame import Heading, Note, Verdicts, ViewFrame
from hil.view.panel import found, numbers
from hil.view.sources import source_of
from hil.view.web_page import Page

PATIENCE_S = 60.0


def heading(live=True):
    return Heading("A hand", "right", live=live)


def asked(url, path=""):
    """The status and the content that a browser gets."""
    try:
        with urllib.request.urlopen(url + path, timeout=PATIENCE_S) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as refused:
        return refused.code, refused.read()


@pytest.fixture(scope="module")
def page():
    served = Page(heading())
    yield served
    served.close()


def test_only_who_knows_the_token_gets_the_page(page):
    status, content = asked(page.url)
    assert status == 200
    assert len(content) > 100_000
    assert b"<title>A hand</title>" in content
    origin, token = page.url.rsplit("/", 1)
    assert len(token) >= 20
    for path in ("", "/index.html", f"/{token[:-1]}", f"/{token}x/", f"/?token={token}", f"//{token}"):
        status, content = asked(origin, path)
        assert status == 403, path
        assert len(content) < 100
    assert asked(page.url, "/../../../etc/passwd")[0] == 404
    with socket.create_connection(("127.0.0.1", int(origin.rsplit(":", 1)[1])), timeout=PATIENCE_S) as raw:
        raw.sendall(b"GET /\xff\xfe HTTP/1.1\r\nHost: x\r\n\r\n")
        assert raw.recv(100).split()[1] in (b"403", b"400")


@pytest.mark.parametrize(
    ("host", "origin", "status"),
    [
        ("127.0.0.1:8700", None, 200),
        ("localhost:9000", "http://localhost:9000", 200),  # forwarded by SSH
        ("attacker.example", None, 403),
        ("attacker.example:8700", "http://attacker.example:8700", 403),
        ("127.0.0.1:8700", "http://attacker.example", 403),
        ("127.0.0.1:8700", "http://127.0.0.1:9999", 403),
        ("127.0.0.1:8700", "null", 403),
        ("127.0.0.1.attacker.example", None, 403),
        ("[::1", None, 403),
    ],
)
def test_a_foreign_host_or_origin_is_refused_in_spite_of_the_token(host, origin, status, page):
    request = urllib.request.Request(page.url, headers={"Host": host} | ({"Origin": origin} if origin else {}))
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            found, headers = answer.status, answer.headers
    except urllib.error.HTTPError as refused:
        found, headers = refused.code, refused.headers
    assert found == status
    assert headers["X-Frame-Options"] == "DENY"
    assert headers["Content-Security-Policy"] == "frame-ancestors 'none'"


def test_a_foreign_origin_gets_no_socket(page):
    address, protocol = page.url.replace("http:", "ws:"), f"viser-v{viser.__version__}"
    for origin in ("http://attacker.example", "http://127.0.0.1:9", "null"):
        with pytest.raises(InvalidStatus, match="403"):
            connect(address, subprotocols=[protocol], origin=origin)


def test_lines_of_the_page_never_run_into_each_other():
    """Many sliders and the sign of life at once; each line is read back as it was said."""
    program = (
        "import threading; from hil.view.__main__ import say\n"
        "for n in range(8): threading.Thread(target=lambda n=n: [say('do', str(n)) for _ in range(500)]).start()\n"
    )
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    assert set(ran.stdout.splitlines()) == {f"do {n}" for n in range(8)}
    assert len(ran.stdout.splitlines()) == 4000


def test_only_who_knows_the_token_gets_a_socket(page):
    address, protocol = page.url.replace("http:", "ws:"), f"viser-v{viser.__version__}"
    with connect(address, subprotocols=[protocol], max_size=None) as opened:
        assert len(opened.recv(PATIENCE_S)) > 16
    with pytest.raises(InvalidStatus, match="403"):
        connect(address.rsplit("/", 1)[0], subprotocols=[protocol])


def test_the_page_is_served_on_the_loopback_address_alone(page):
    port = int(re.search(r":(\d+)/", page.url).group(1))
    lines = [line.split() for name in ("tcp", "tcp6") for line in Path("/proc/net", name).read_text().splitlines()]
    listening = [line[1] for line in lines if line[3] == "0A"]
    assert [one for one in listening if one.endswith(f":{port:04X}")] == [f"0100007F:{port:04X}"]


def test_what_comes_from_a_recording_is_text_and_no_markup():
    told = found(Verdicts(3, ("<script>x</script>",)), [Note(1.0, "<img src=x>", "error")])
    assert "<script" not in told
    assert "&lt;script&gt;" in told
    assert "<img" not in told
    assert "&lt;b&gt;" in numbers(Heading("<b>", "right", live=False), ViewFrame(0.0, np.zeros(16)), "")


def test_a_hand_is_driven_to_the_same_bytes_with_and_without_a_page():
    def moved(feed):
        with open_target(seed=5) as target:
            if feed is not None:
                feed.follow(source_of(target))
            for code in (0, 30_000, 60_000, 0):
                target.hand.command_codes([code] * len(Channel))
                target.clock.sleep_until(target.clock.now() + 1.0)
                target.hand.read_codes()
            return target.wire.since(0, 0.0)

    feed = Feed(heading())
    seen = moved(feed)
    feed.note("done")
    feed.verdicts(1, ["one sentence"])
    feed.end(stay=False)
    assert seen == moved(None)


def test_without_a_browser_the_end_waits_for_nobody():
    feed = Feed(heading())
    assert asked(feed.url)[0] == 200
    feed.end(stay=False)
    with pytest.raises(OSError, match=r"refused|reset"):
        asked(feed.url)


class Failing:
    """A source that cannot be read."""

    def frame(self):
        raise ZeroDivisionError("no such frame")


def test_a_source_that_fails_is_said_once_and_ends_the_page_alone(capfd):
    feed = Feed(heading())
    feed.follow(Failing())
    until(lambda: not feed.sending)
    feed.end(stay=True)
    assert "the page has ended (no such frame); the hand continues" in capfd.readouterr().err


@pytest.mark.parametrize("end", [lambda feed: feed.end(stay=False), Feed.abandon])
def test_a_stopped_page_keeps_nobody_waiting(end, monkeypatch):
    """Its pipe fills up, and the thread that writes into it waits; the hand's program does not."""
    for name in ("SILENT_S", "STOP_S"):
        monkeypatch.setattr(feed_module, name, 0.5)
    with open_target() as target:
        feed = Feed(heading())
        os.kill(feed.pid, signal.SIGSTOP)
        feed.follow(source_of(target))
        for _ in range(5_000):
            feed.note("more than a pipe holds, more than a pipe holds")
        target.clock.sleep_until(target.clock.now() + 1.0)
        assert target.hand.read_codes().shape == (7,)
        end(feed)
    with pytest.raises(ProcessLookupError):
        os.kill(feed.pid, 0)


def test_a_page_that_does_not_start_is_said_and_the_hand_goes_on(tmp_path):
    program = (
        "import sys; import hil.view.feed as feed; feed.START_S = 0.01; from hil.cli import main; "
        "main(['validate', '--view', '--only', 'presence', '--out', 'x'])"
    )
    ran = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr.splitlines()[0] == "the page did not start within 0.01 s; the hand runs without it"


def until(holds):
    late, waiting = WallClock().now() + PATIENCE_S, Event()
    while not holds():
        assert WallClock().now() < late
        waiting.wait(0.05)


def recording_of(path, *, reads):
    with open_target() as target:
        recorder = Recorder(target, "policy", path)
        recorder.begin()
        for _ in range(20):
            target.hand.command_codes([9000] * len(Channel))
            target.clock.sleep_until(target.clock.now() + 0.05)
            if reads:
                target.hand.read_codes()
        recorder.finish()


@pytest.mark.slow
def test_a_recording_is_served_until_ctrl_c(tmp_path):
    recording_of(tmp_path / "run.mcap", reads=True)
    command = [sys.executable, "-m", "hil.cli", "view", str(tmp_path / "run.mcap")]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as served:
        said, address = served.stderr.readline().split()
        assert said == "view"
        assert asked(address)[0] == 200
        served.send_signal(signal.SIGINT)
        printed, errors = served.communicate(timeout=PATIENCE_S)
    assert (served.returncode, printed, errors) == (0, "", "Stopping…\n")


def test_without_the_extra_one_line_names_it(tmp_path):
    for command in (("emulate", "--view"), ("validate", "--view", "--out", "x")):
        program = f"import sys; sys.modules['viser'] = None; from hil.cli import main; main({command!r})"
        refused = subprocess.run(
            [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
        )
        assert refused.returncode == 2
        assert refused.stderr == "Error: `--view` needs the extra `view`; from a checkout: pip install -e '.[view]'\n"
        assert not (tmp_path / "x").exists()


def test_only_a_page_that_may_do_something_has_a_line_for_it():
    said = []
    looked_at = Page(heading())
    worked_on = Page(Heading("A hand", "right", live=True, hands_on=True), on_words=said.append)
    try:
        fields = [
            [handle for handle in page._server.gui._gui_input_handle_from_uuid.values() if handle.label == "Words"]
            for page in (looked_at, worked_on)
        ]
        assert list(map(len, fields)) == [0, 1]
        typed = SimpleNamespace(value="help\nmode\nlo")
        for callback in fields[1][0]._impl.update_cb:
            asyncio.run(callback(SimpleNamespace(client=object(), target=typed)))
        assert said == ["help", "mode"]
        assert typed.value == "lo"
    finally:
        looked_at.close()
        worked_on.close()


def test_a_live_page_counts_from_its_first_reading_and_shows_a_hand_at_rest_on_its_travel():
    """A hand on a port has the clock of this machine, which says its hours; NaN and a flat line spanned no axis."""
    page = Page(Heading("A hand", "right", live=True))
    try:
        for t in (68602.0, 68602.5):
            page.show(ViewFrame(t, np.zeros(16)))
        page.show(Note(68602.25, "closed"))
        assert [frame.t for frame in page._frames] == [0.0, 0.5]
        assert page._notes[0].t == 0.25
        low, high = page._angles.scales["y"]["range"]
        assert low < 0.0 < high
    finally:
        page.close()
