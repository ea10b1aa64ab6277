"""SHELL: a program of this machine speaks to the operator of a team over its Unix socket.

It imports little, so that a stop is on its way before most programs have begun.
"""

from __future__ import annotations

import json
import socket
from pathlib import Path
from typing import Any, Final, Self

from quadriga.shared.errors import BusError, system_reason

SUFFIX: Final = ".sock"
PATIENCE: Final = 2.0  # s, longest wait for an answer
HEARD: Final = "heard"  # the kind of the first answer to an emergency stop; what came of it follows
_LONGEST: Final = 65_536  # bytes of one


def socket_path(folder: Path, team: str, pid: int) -> Path:
    """Where the operator with process id `pid` of a team listens.

    Args:
        folder: the user's folder of what is true while processes run.
        team: its name.
        pid: of the operator's process.
    """
    return folder / f"{team}-{pid}{SUFFIX}"


class ControlLink:
    """A connection to an operator; a context.

    Args:
        path: of its socket.
        patience: longest wait for an answer, s.

    Attributes:
        team: its operator's, by the socket's name.

    Raises:
        OSError: nobody listens there.
    """

    def __init__(self, path: Path, patience: float = PATIENCE) -> None:
        self.team = path.name.rpartition("-")[0]
        self._socket = socket.socket(socket.AF_UNIX)
        self._patience = patience
        self._socket.settimeout(patience)
        try:
            self._socket.connect(str(path))
        except OSError:
            self._socket.close()
            raise
        self._rest = b""

    def say(self, kind: str, **fields: Any) -> None:
        """Say something, see `quadriga.drive.driver_words`."""
        self._socket.sendall(json.dumps({"kind": kind, **fields}).encode() + b"\n")

    def ask(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Say something, and wait for the answer.

        Raises:
            BusError: none comes, or it is none.
        """
        try:
            self.say(kind, **fields)
        except OSError as error:
            raise self._wrong(system_reason(error)) from None
        return self.answer()

    def stop(self, reason: str, patience: float = PATIENCE) -> dict[str, Any]:
        """Have every joint damped; what came of it.

        Args:
            reason: told to every agent.
            patience: longest wait for it once the operator has heard this, s.

        Raises:
            BusError: no answer comes, or it is none.
        """
        self.say("estop", text=reason)
        return self.await_stop(patience)

    def await_stop(self, patience: float = PATIENCE) -> dict[str, Any]:
        """What came of an emergency stop, see `stop`."""
        answer = self.answer()
        return self.answer(patience) if answer.get("kind") == HEARD else answer

    def answer(self, patience: float | None = None) -> dict[str, Any]:
        """The next answer.

        Args:
            patience: longest wait for it, s; None: the connection's own.

        Raises:
            BusError: none comes, or it is none.
        """
        patience = self._patience if patience is None else patience
        self._socket.settimeout(patience)
        try:
            while b"\n" not in self._rest:
                received = self._socket.recv(_LONGEST)
                if not received or len(self._rest) > _LONGEST:
                    raise self._wrong("no answer")
                self._rest += received
            line, _, self._rest = self._rest.partition(b"\n")
            answer = json.loads(line)
        except (TimeoutError, ConnectionError):
            raise self._wrong(f"no answer within {patience:g} s") from None
        except (ValueError, RecursionError):  # the latter for what nests too deeply
            raise self._wrong("an answer that is no JSON") from None
        if not isinstance(answer, dict):
            raise self._wrong("an answer that is no JSON object")
        return answer

    def _wrong(self, got: str) -> BusError:
        return BusError("the operator of the team", got, "an answer", "is its process frozen?")

    def close(self) -> None:
        """Leave."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
