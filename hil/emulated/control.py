"""Control socket of a served hand: one line in, one line out, for test runners in any language."""

from __future__ import annotations

import logging
import select
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

_LOG = logging.getLogger(__name__)
LARGEST = 4096
"""Size limit of a line, bytes."""


class ControlSocket:
    """Unix-domain socket at a path; `serve` answers the lines of all clients without waiting."""

    def __init__(self, path: Path, answer: Callable[[str], str]) -> None:
        """Listen at `path`; `answer` returns the answer to a line, one line too.

        Raises:
            FileExistsError: the path exists.
            OSError: the socket cannot be made there.
        """
        if path.exists() or path.is_symlink():
            raise FileExistsError(f"{path} exists already; choose another path, or remove it")
        self._path, self._answer = path, answer
        self._clients: dict[socket.socket, bytes] = {}
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._server.bind(str(path))
            self._server.listen()
        except OSError as error:
            self._server.close()
            raise OSError(f"no control socket at {path}: {error}") from error

    def serve(self) -> None:
        """Accept clients, and answer their complete lines."""
        ready, _, _ = select.select([self._server, *self._clients], [], [], 0.0)
        for end in ready:
            if end is self._server:
                client, _ = self._server.accept()
                client.setblocking(False)
                self._clients[client] = b""
            else:
                self._read(end)

    def close(self) -> None:
        """Close all connections and remove the socket."""
        for end in (self._server, *self._clients):
            end.close()
        with suppress(OSError):
            self._path.unlink()

    def _read(self, client: socket.socket) -> None:
        try:
            data = client.recv(LARGEST)
            *lines, self._clients[client] = (self._clients[client] + data).split(b"\n")
            for line in lines:
                client.sendall(f"{self._answer(line.decode(errors='replace'))}\n".encode())
        except OSError as error:  # a client that does not read its answers, or has gone
            _LOG.info("a client of %s is dropped: %s", self._path, error)
            data = b""
        if not data or len(self._clients[client]) > LARGEST:
            del self._clients[client]
            client.close()
