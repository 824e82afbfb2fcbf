"""The control socket: one line in, one line out, whatever a client sends."""

import socket
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.emulated.control import LARGEST, ControlSocket


def said(control, client, sent):
    """Return the lines that a client receives for its bytes, and whether it is still connected."""
    client.sendall(sent)
    for _ in range(len(sent) // LARGEST + 2):
        control.serve()
    client.setblocking(False)
    try:
        data = client.recv(1 << 20)
    except BlockingIOError:
        return [], True
    return data.decode().splitlines(), bool(data)


@pytest.fixture(scope="module")
def control(tmp_path_factory):
    with closing(ControlSocket(tmp_path_factory.mktemp("control") / "hand", lambda line: f"ok {line.strip()}")) as made:
        yield made


@given(lines=st.lists(st.from_regex(r"[a-z:=. ]{0,40}", fullmatch=True), max_size=5))
def test_each_line_has_one_answer(control, lines):
    with closing(socket.socket(socket.AF_UNIX)) as client:
        client.connect(str(control._path))
        control.serve()
        answers, _ = said(control, client, "".join(f"{line}\n" for line in lines).encode())
        assert [answer.rstrip() for answer in answers] == [f"ok {line.strip()}".rstrip() for line in lines]


def test_a_client_with_an_endless_line_is_dropped_and_others_go_on(control):
    with closing(socket.socket(socket.AF_UNIX)) as endless, closing(socket.socket(socket.AF_UNIX)) as other:
        for client in (endless, other):
            client.connect(str(control._path))
        control.serve()
        assert said(control, endless, b"x" * (2 * LARGEST)) == ([], False)
        assert said(control, other, b"look\n") == (["ok look"], True)


def test_an_existing_path_is_refused_and_the_socket_is_removed_at_the_end(tmp_path):
    path = tmp_path / "hand"
    with closing(ControlSocket(path, str)), pytest.raises(FileExistsError, match="exists already"):
        ControlSocket(path, str)
    assert not path.exists()
