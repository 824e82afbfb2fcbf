"""The page's access token, and its title.

viser has no tokens. On one machine others may have accounts, and any web page in a browser may try ports of the
machine that it runs on. So the page's address has a random first folder. Without it a request gets nothing: no file,
and no socket either, because viser's page takes the socket's address from its own.
"""

from __future__ import annotations

import html
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any

import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

HttpAnswer = Callable[[ServerConnection, Request], Response | None]
TOKEN_BYTES = 16
"""As many as a random UUID has, and more than can be tried."""
VISER_TITLE = b"<title>Viser</title>"


def new_token() -> str:
    """Return a secret for one page."""
    return secrets.token_urlsafe(TOKEN_BYTES)


@contextmanager
def requiring_token(token: str, title: str) -> Iterator[None]:
    """Let servers that are started inside answer only below `/TOKEN`, with a page of this title.

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
        return start(*arguments, process_request=_asking_for(token, title, process_request), **settings)

    websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]  # as long as viser starts
    try:
        yield
    finally:
        websockets.asyncio.server.serve = start  # type: ignore[misc]
    if not started:
        raise RuntimeError("this version of viser starts its server in another way, and its page would ask no token")


def _asking_for(token: str, title: str, answer: HttpAnswer) -> HttpAnswer:
    def asked(connection: ServerConnection, request: Request) -> Response | None:
        path, _, query = request.path.partition("?")
        given, _, rest = path.removeprefix("/").partition("/")
        if not secrets.compare_digest(given.encode(errors="surrogateescape"), token.encode()):
            return connection.respond(HTTPStatus.FORBIDDEN, "The address that aero-hil printed has a token.\n")
        request.path = f"/{rest}?{query}" if query else f"/{rest}"
        if rest in ("", "index.html"):
            request.headers.pop("Accept-Encoding", None)  # the title is changed in plain text
            return _titled(answer(connection, request), title)
        return answer(connection, request)

    return asked


def _titled(response: Response | None, title: str) -> Response | None:
    """Return the page with a title of ours; viser has no setting for it."""
    if response is not None and VISER_TITLE in (response.body or b""):
        response.body = bytes(response.body).replace(VISER_TITLE, f"<title>{html.escape(title)}</title>".encode())
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))
    return response
