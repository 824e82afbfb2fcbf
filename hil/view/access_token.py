"""Access control of the page's server: token, host and origin checks, no framing; also the page's head.

viser has none of these. Other accounts of the machine, and any web page in a browser, can reach a local port. The
page's address therefore begins with a random folder, without which the server refuses files and WebSockets alike;
viser's page derives the WebSocket address from its own.
"""

import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

HttpAnswer = Callable[[ServerConnection, Request], Response | None]
TOKEN_BYTES = 16
"""Size of the token: that of a random UUID, beyond brute force."""
VISER_TITLE = b"<title>Viser</title>"
LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Accepted names in `Host`; any other name may be a DNS rebinding attack. Any port, for SSH tunnels."""
POLICY = {
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}
"""Headers of every response, against framing by other pages and against leaking the token as referrer."""


def new_token() -> str:
    """Return a new random token for one page."""
    return secrets.token_urlsafe(TOKEN_BYTES)


@contextmanager
def guarding(token: str, head: str) -> Iterator[None]:
    """Restrict servers that are started in this context to paths below `/TOKEN`, with `head` in the page's head.

    Raises:
        RuntimeError: no server was started through `websockets`, so the token would not be checked.
    """
    # viser passes `websockets` its request handler and has no hook before it, so the server's start function is
    # replaced while viser starts. A proxy in front was rejected: viser's own TCP port would still answer without token.
    start = websockets.asyncio.server.serve
    started = []

    def serve(*arguments: Any, process_request: HttpAnswer, **settings: Any) -> Any:
        started.append(True)
        return start(*arguments, process_request=_guarded(token, head, process_request), **settings)

    websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]  # as long as viser starts
    try:
        yield
    finally:
        websockets.asyncio.server.serve = start  # type: ignore[misc]
    if not started:
        raise RuntimeError("this version of viser starts its server in another way, and its page would ask no token")


def _guarded(token: str, head: str, answer: HttpAnswer) -> HttpAnswer:
    def asked(connection: ServerConnection, request: Request) -> Response | None:
        path, _, query = request.path.partition("?")
        given, _, rest = path.removeprefix("/").partition("/")
        request.path = f"/{rest}?{query}" if query else f"/{rest}"
        is_page = rest in ("", "index.html")
        if not is_ours(request.headers.get_all("Host"), request.headers.get_all("Origin")):
            why = "The page answers its own origin on this machine only.\n"
            response: Response | None = connection.respond(HTTPStatus.FORBIDDEN, why)
        elif not secrets.compare_digest(given.encode(errors="surrogateescape"), token.encode()):
            response = connection.respond(HTTPStatus.FORBIDDEN, "The address that aero-hil printed has a token.\n")
        else:
            if is_page:
                request.headers.pop("Accept-Encoding", None)  # the page's head must be uncompressed to be changed
            response = answer(connection, request)
        if response is not None:  # None upgrades the connection to a WebSocket
            if is_page:
                _put_head(response, head)
            response.headers.update(POLICY)
        return response

    return asked


def is_ours(hosts: list[str], origins: list[str]) -> bool:
    """Return True if `Host` names this machine and every `Origin` is the page's own."""
    if len(hosts) != 1 or any(origin != f"http://{hosts[0]}" for origin in origins):
        return False
    try:
        return urlsplit(f"http://{hosts[0]}").hostname in LOOPBACK
    except ValueError:  # not a host's name
        return False


def _put_head(response: Response, head: str) -> None:
    """Replace viser's title by our head, because viser has no setting for the head."""
    if VISER_TITLE in (response.body or b""):
        response.body = bytes(response.body).replace(VISER_TITLE, head.encode())
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))
