"""SHELL of a controller of one's own in Python: bus, barrier, words, status, signals, clean end."""

from __future__ import annotations

import sys
from typing import Final

import numpy as np

from quadriga.agents.inbox import Inbox
from quadriga.agents.shell import answer_states
from quadriga.controller.motor_command import build_command
from quadriga.controller.stepped import Step, SteppedController
from quadriga.controller.task import ControllerTask, read_task
from quadriga.shared.codec import decode, encode
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.messages import State
from quadriga.shared.printable import printable_line
from quadriga.shared.runtime.signals import stop_on_signals

_FAILED: Final = 1
_INTERRUPTED: Final = 130


def serve(step: Step, task: ControllerTask | None = None) -> None:
    """Be a robot's agent until the walk is over: each state is answered by `step`.

    `step(state, reference)` gets what the robot measures at a tick, and what the operator asks for,
    of which no speed is left while the team stands or is to stop; it gives the motor command, as
    `build_command` makes it. It is called once for each tick in lock-step; in real time for the
    newest state, within a millisecond. While an emergency stop is in force the joints are damped
    and it is not called.

    What takes long, as to load weights, is done before it is called.

    Args:
        step: the controller. What it remembers is its own.
        task: the robot and the team; by default what `quadriga` has started this program for.

    Raises:
        SystemExit: it cannot take part, or the team has vanished: status 1, and one line on
            stderr says why. What `step` raises goes through.
    """
    try:
        robot = task or read_task()
        stopped = stop_on_signals()
        agent = SteppedController(robot.config, robot.robot, step)
        inbox = Inbox(robot.config, robot.robot, peers=())
        answer_states(robot.config, agent, inbox, stopped, _load_codec)
    except QuadrigaError as error:
        print(printable_line(f"quadriga: {error}"), file=sys.stderr, flush=True)
        raise SystemExit(_FAILED) from None
    except KeyboardInterrupt:
        raise SystemExit(_INTERRUPTED) from None


def _load_codec() -> None:
    """Read and write a message of each kind: what does that is not loaded in the first tick."""
    still = State(0, 0, *(np.zeros(cut.stop - cut.start) for cut in State.CUTS.values()))
    encode(build_command(decode(encode(still), State)))
