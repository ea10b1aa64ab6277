"""What this process would do next, without doing it: a call in a copy of the process.

The operating system copies all that the process holds. So a branch of a walk goes on from exactly
the state that the walk is in, whatever that state is made of: MuJoCo's, the agents', random
streams, loose stones.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from typing import NoReturn

from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.signals import die_with_parent


def run_branch(call: Callable[[], bytes]) -> bytes:
    """What `call` returns in a copy of this process; this process stays as it is.

    To be used in a process without other threads of Python's, as workers are: a copy has none of
    them, but the locks that they held.

    Raises:
        ProcessError: the call raised something, or the copy was killed.
    """
    parent = os.getpid()
    readable, writable = os.pipe()
    branch = os.fork()
    if branch == 0:
        os.close(readable)
        _answer(call, writable, parent)
    os.close(writable)
    try:
        with os.fdopen(readable, "rb") as pipe:
            answer = pipe.read()
    finally:
        _, status = os.waitpid(branch, 0)
    if status:
        lines = answer.decode(errors="replace").splitlines()
        raise ProcessError(
            "a branch of a walk",
            lines[-1] if lines else "its death",
            "an answer",
            "" if lines else "killed, perhaps because memory was short",
        )
    return answer


def _answer(call: Callable[[], bytes], writable: int, parent: int) -> NoReturn:
    """The whole life of the copy, which must never return to what the process was about to do."""
    status = 1
    try:
        die_with_parent(parent)
        with os.fdopen(writable, "wb") as pipe:
            try:
                pipe.write(call())
                status = 0
            except Exception:
                pipe.write(traceback.format_exc().encode())
    finally:
        os._exit(status)
