"""Where a process begins: `quadriga`, or `python -m quadriga`."""

from __future__ import annotations

import signal
import sys
from typing import Final

_STOP: Final = "estop"


def main() -> int:
    """Run the command line; a signal that comes while it is being imported waits until then."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    from quadriga.shared.errors import QuadrigaError
    from quadriga.shared.printable import printable_line
    from quadriga.shared.runtime.scheduling import go_first

    if sys.argv[1:2] == [_STOP]:  # what it imports must not wait for those that it stops
        go_first()

    try:
        from quadriga.commands.parser import main as command_line
    except QuadrigaError as error:  # of a package that adds to this one
        print(printable_line(f"quadriga: {error}"), file=sys.stderr)
        return 2

    return command_line()


if __name__ == "__main__":
    sys.exit(main())
