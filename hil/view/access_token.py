"""Guard of the page's server: an access token, its own name and origin, and no frame around it; also the page's head.

viser has none of them. On one machine others may have accounts, and any web page in a browser may try ports of the
machine that it runs on. So the page's address has a random first folder. Without it a request gets nothing: no file,
and no socket either, because viser's page takes the socket's address from its own.
"""

from __future__ import annotations

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
"""As many as a random UUID has, and more than can be tried."""
VISER_TITLE = b"<title>Viser</title>"
LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine; another one in `Host` is a foreign site that resolves to this address. Any port, for SSH."""
POLICY = {
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}
"""Headers of every response: no page may show this one in a frame, and the token is told to nobody."""


def new_token() -> str:
    """Return a secret for one page."""
    return secrets.token_urlsafe(TOKEN_BYTES)


@contextmanager
def guarding(token: str, head: str) -> Iterator[None]:
    """Let servers that are started inside answer only below `/TOKEN`, with this HTML in the page's head.

    viser hands `websockets` a function that answers requests and offers no place to put one before it. So the call that
    starts the server is replaced for as long as viser starts; `tests/harness/view` asks without the token. A proxy in
    front would not do: viser listens on a TCP port of its own, which would still answer without the token.

    Raises:
        RuntimeError: no server was started this way, so that nothing would ask for the token.
    """
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
                request.headers.pop("Accept-Encoding", None)  # the head is changed in plain text
            response = answer(connection, request)
        if response is not None:  # else it becomes a socket
            if is_page:
                _put_head(response, head)
            response.headers.update(POLICY)
        return response

    return asked


def is_ours(hosts: list[str], origins: list[str]) -> bool:
    """Return whether a request names this machine, and comes from the page itself where it has an origin."""
    if len(hosts) != 1 or any(origin != f"http://{hosts[0]}" for origin in origins):
        return False
    try:
        return urlsplit(f"http://{hosts[0]}").hostname in LOOPBACK
    except ValueError:  # not a host's name
        return False


def _put_head(response: Response, head: str) -> None:
    """Put a head of ours in place of viser's title; viser has no setting for it."""
    if VISER_TITLE in (response.body or b""):
        response.body = bytes(response.body).replace(VISER_TITLE, head.encode())
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))
