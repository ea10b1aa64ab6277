"""Whatever answers at an operator's socket, a program gets an answer or one clear error."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from quadriga.drive.client import ControlLink
from quadriga.shared.errors import BusError


def answer_to(said: bytes, folder: Path) -> dict[str, object]:
    """What a program hears if somebody says this at the socket and leaves."""
    path = folder / "team-1.sock"
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))
        server.listen()
        with ControlLink(path) as link:
            operator, _ = server.accept()
            with operator:
                operator.sendall(said)
            return link.answer()


def test_an_answer_is_what_was_said(tmp_path: Path) -> None:
    assert answer_to(b'{"kind": "heard"}\n{"kind"', tmp_path) == {"kind": "heard"}


@pytest.mark.parametrize(
    ("said", "got"),
    [
        (b"", "no answer"),
        (b"{", "no answer"),
        (b"[" * 30_000 + b"\n", "an answer that is no JSON"),
        (b"\xff\n", "an answer that is no JSON"),
        (b'{"number": ' + b"9" * 5000 + b"}\n", "an answer that is no JSON"),
        (b"[]\n", "an answer that is no JSON object"),
    ],
)
def test_what_is_no_answer_is_one_error(said: bytes, got: str, tmp_path: Path) -> None:
    with pytest.raises(BusError, match=f"got {got}, expected an answer"):
        answer_to(said, tmp_path)
