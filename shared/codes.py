"""Codes that programs decide by; the prose beside them is for people alone.

An event carries one of `EVENTS`. Statuses of plans and reasons to stop are written `code` or
`code:detail` (`solved`, `nominal:infeasible`, `estop:dog on the track`): `with_detail` writes the
second form, `code_of` reads the code of either.
"""

from __future__ import annotations

from typing import Final

EVENTS: Final[dict[str, str]] = {}  # the kind of event by its code


def _event(code: str, kind: str) -> str:
    EVENTS[code] = kind
    return code


START: Final = _event("start", "start")  # the walk begins
TERRAIN: Final = _event("terrain", "terrain")  # what the ground is
PAYLOAD: Final = _event("payload", "payload")  # a robot carries a load
PUSH: Final = _event("push", "push")  # a push of a robot begins
FALL: Final = _event("fall", "fall")  # a robot fell
UNSTABLE: Final = _event("unstable", "fault")  # the simulation is unstable: the walk ends at once
WEAK_MOTOR: Final = _event("weak-motor", "fault")  # a motor gives less torque from now on
FAULT_BEGINS: Final = _event("fault-begins", "fault")  # a fault that is made on purpose begins
FAULT_ENDS: Final = _event("fault-ends", "fault")  # a fault that was made on purpose is over
FAULT_ASKED: Final = _event("fault-asked", "fault")  # somebody asked for a fault as in world.faults
FAULT_REFUSED: Final = _event("fault-refused", "fault")  # there cannot be the one asked for
MALFORMED: Final = _event("malformed", "fault")  # commands that are none, or that nobody can mean
ESTOPPED: Final = _event("estop", "fault")  # simulated joints are damped from now on
LIES: Final = _event("lies", "fault")  # a robot that is stopped has sunk to the ground: no fall
STOP_ASKED: Final = _event("stop-asked", "fault")  # somebody asked the team to slow down and stand
RESET: Final = _event("reset", "fault")  # the operator has released the emergency stop
INPUT_LOST: Final = _event("input-lost", "fault")  # an agent slows down and stands: an input lacks
HALTS: Final = _event("halts", "fault")  # an agent slows down and stands, as somebody has asked
RESUMED: Final = _event("resumed", "fault")  # an agent walks again: its inputs are valid again
STANDS_UP: Final = _event("stands-up", "fault")  # an agent's robot, which was damped, stands up
STANDS_AGAIN: Final = _event("stands-again", "fault")  # a robot stands that had been damped
BRIDGE_MODE: Final = _event("bridge-mode", "bridge")  # a robot stands up, walks, lies down, is hot
ROBOT_STOPPED: Final = _event("robot-stopped", "fault")  # a bridge has damped its robot
TIME_OVER: Final = _event("time-over", "stop")  # the walk is over: world.duration have passed
FALLEN: Final = _event("fallen", "stop")  # the walk is over: a robot fell
SIGNAL: Final = _event("signal", "stop")  # the walk is over: the world was told to stop
STOPPED: Final = _event("stopped", "stop")  # the walk is over: somebody has asked the team to stop
COMMAND_LOST: Final = _event("command-lost", "stop")  # the walk is over: a robot has no commands
PLANT_GONE: Final = _event("plant-gone", "stop")  # the walk is over: a plant left or is silent
PLANT_FAILED: Final = _event("plant-failed", "stop")  # the walk is over: the plant failed
LINK_LOST: Final = _event("link-lost", "stop")  # the walk is over: the link to the router is gone
LEAD_GONE: Final = _event("lead-gone", "stop")  # who drives time vanished: as the recorder notes it

DOWN: Final = frozenset((FALL, ROBOT_STOPPED))  # a robot that walks no more: the walk ends


def with_detail(code: str, detail: str) -> str:
    """A status or a reason to stop that has a detail: `code:detail`, the code without a colon."""
    return f"{code}:{detail}"


def code_of(text: str) -> str:
    """The code of a plan's status or of a reason to stop; "" of none."""
    return text.partition(":")[0]
