"""Where a process begins and ends: `quadriga`, or `python -m quadriga`."""

from __future__ import annotations

import gc
import io
import os
import signal
import sys
from typing import Any, Final, NoReturn

_STOP: Final = "estop"
_FEW_COLLECTIONS: Final = 50_000  # new objects between two; imports make many and no garbage
_WRONG: Final = 2
_INTERRUPTED: Final = 130
_ENDLESS: Final = ("echo", "status")  # they only show, until nobody reads any more


class _Unread(io.FileIO):
    """A standard stream whose reader may leave, as of `walk | head -1`: the walk goes on."""

    def write(self, text: Any) -> int:
        try:
            return super().write(text)
        except BrokenPipeError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return len(text)


def main() -> NoReturn:
    """Run the command line and end the process with its exit status."""
    end(run())


def run() -> int:
    """Run the command line; a signal that comes while it is being imported waits until then."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    gc.set_threshold(_FEW_COLLECTIONS)
    for name in ("stdout", "stderr"):
        setattr(sys, name, _forgiving(getattr(sys, name)))
    from quadriga.shared.errors import QuadrigaError
    from quadriga.shared.printable import printable_line
    from quadriga.shared.runtime.opengl import do_without_opengl
    from quadriga.shared.runtime.scheduling import go_first

    do_without_opengl()
    if sys.argv[1:2] == [_STOP]:  # what it imports must not wait for those that it stops
        go_first()
        from quadriga.drive.quick_stop import stop_quickly

        done = stop_quickly(sys.argv[2:])
        if done.status is not None:
            return done.status
        sys.argv += done.options

    try:
        from quadriga.commands.parser import main as command_line
    except QuadrigaError as error:  # of a package that adds to this one
        print(printable_line(f"quadriga: {error}"), file=sys.stderr)
        return _WRONG

    return command_line()


def _forgiving(stream: Any) -> Any:
    """A standard stream that writes `?` for a letter that the terminal does not have."""
    if not isinstance(stream, io.TextIOWrapper):  # it is closed, or a notebook's
        return stream
    kind = io.FileIO if sys.argv[1:2] and sys.argv[1] in _ENDLESS else _Unread
    raw: Any = kind(stream.fileno(), "w", closefd=False)
    unbuffered = stream.write_through
    return io.TextIOWrapper(
        raw if unbuffered else io.BufferedWriter(raw),
        stream.encoding,
        "replace",
        line_buffering=stream.line_buffering,
        write_through=unbuffered,
    )


def end(status: int) -> NoReturn:
    """End this process at once: to take the interpreter and its libraries down costs 0.2 s.

    No signal is heard meanwhile, and a library that waits for a thread of its own may wait for
    ever. What must be finished is a `with` block's, and those are over by now.
    """
    try:
        for stream in filter(None, (sys.stdout, sys.stderr)):
            stream.flush()
    except BrokenPipeError:  # of `quadriga config | head`
        pass
    except OSError as error:
        os.write(2, f"quadriga: the output: got {error.strerror}, expected room for it\n".encode())
        status = status or _WRONG
    except KeyboardInterrupt:  # nobody reads what is left
        status = status or _INTERRUPTED
    os._exit(status)


if __name__ == "__main__":
    main()
