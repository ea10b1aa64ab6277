"""Codes that programs decide by; the prose beside them is for people alone.

An event carries one of `EVENTS`. Statuses of plans and reasons to stop are written `code` or
`code:detail` (`solved`, `nominal:infeasible`, `estop:dog on the track`): `with_detail` writes the
second form, `code_of` reads the code of either.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple


class EventCode(NamedTuple):
    """What an event's code stands for: the kind of event, and what has happened."""

    kind: str
    meaning: str


START: Final = "start"
TERRAIN: Final = "terrain"
PAYLOAD: Final = "payload"
PUSH: Final = "push"
FALL: Final = "fall"
UNSTABLE: Final = "unstable"
WEAK_MOTOR: Final = "weak-motor"
FAULT_BEGINS: Final = "fault-begins"
FAULT_ENDS: Final = "fault-ends"
FAULT_ASKED: Final = "fault-asked"
FAULT_REFUSED: Final = "fault-refused"
SILENT: Final = "silent"
GONE: Final = "gone"
BACK: Final = "back"
OPERATOR_GONE: Final = "operator-gone"
OPERATOR_BACK: Final = "operator-back"
MALFORMED: Final = "malformed"
TIME_OVER: Final = "time-over"
FALLEN: Final = "fallen"
SIGNAL: Final = "signal"
STOPPED: Final = "stopped"
PLANT_GONE: Final = "plant-gone"
PLANT_FAILED: Final = "plant-failed"
LINK_LOST: Final = "link-lost"
LEAD_GONE: Final = "lead-gone"
ESTOPPED: Final = "estop"
LIES: Final = "lies"
STOP_ASKED: Final = "stop-asked"
RESET: Final = "reset"
LOWERED: Final = "lowered"
INPUT_LOST: Final = "input-lost"
HALTS: Final = "halts"
RESUMED: Final = "resumed"
RISES: Final = "rises"
STANDS_AGAIN: Final = "stands-again"
BRIDGE_MODE: Final = "bridge-mode"
ROBOT_STOPPED: Final = "robot-stopped"
CLOCK_OFF: Final = "clock-off"
CLOCK_SET: Final = "clock-set"

EVENTS: Final[Mapping[str, EventCode]] = MappingProxyType(
    {
        START: EventCode("start", "the walk begins"),
        TERRAIN: EventCode("terrain", "what the ground is"),
        PAYLOAD: EventCode("payload", "a robot carries a load"),
        PUSH: EventCode("push", "a push of a robot begins"),
        FALL: EventCode("fall", "a robot fell"),
        UNSTABLE: EventCode("fault", "the simulation is unstable: the walk ends at once"),
        WEAK_MOTOR: EventCode("fault", "a motor gives less torque from now on"),
        FAULT_BEGINS: EventCode("fault", "a fault that is made on purpose begins"),
        FAULT_ENDS: EventCode("fault", "a fault that was made on purpose is over"),
        FAULT_ASKED: EventCode("fault", "somebody has asked for a fault: as in world.faults"),
        FAULT_REFUSED: EventCode("fault", "somebody has asked for one that there cannot be"),
        SILENT: EventCode("fault", "a robot did not answer in time: the world waits no longer"),
        GONE: EventCode("fault", "a robot left the bus: the world waits no longer"),
        BACK: EventCode("fault", "a robot answers again: the world waits for it"),
        OPERATOR_GONE: EventCode("fault", "the operator left the bus: no reference counts"),
        OPERATOR_BACK: EventCode("fault", "the operator is there again"),
        MALFORMED: EventCode("fault", "commands that are none, or that nobody can mean"),
        ESTOPPED: EventCode("fault", "the emergency stop: simulated joints are damped from now on"),
        LIES: EventCode("fault", "a robot that is stopped has sunk to the ground: no fall"),
        STOP_ASKED: EventCode("fault", "somebody has asked the team to slow down and stand"),
        RESET: EventCode("fault", "the operator has released the emergency stop"),
        LOWERED: EventCode("fault", "a simulated robot without commands is led down: no fall"),
        INPUT_LOST: EventCode("fault", "an agent slows down and stands: it lacks an input"),
        HALTS: EventCode("fault", "an agent slows down and stands, as somebody has asked"),
        RESUMED: EventCode(
            "fault", "an agent walks again: its inputs have been whole for `team.resume_after`"
        ),
        RISES: EventCode("fault", "an agent gets its robot up, which was led down or stopped"),
        STANDS_AGAIN: EventCode("fault", "an agent's robot stands that had been down"),
        BRIDGE_MODE: EventCode(
            "bridge", "a bridge's robot begins to stand up, walk or lie down, or is hot"
        ),
        ROBOT_STOPPED: EventCode("fault", "a bridge has stopped its robot: damped, then passive"),
        CLOCK_OFF: EventCode("fault", "a plant's system clock is off by more than 1 ms"),
        TIME_OVER: EventCode("stop", "the walk is over: world.duration have passed"),
        FALLEN: EventCode("stop", "the walk is over: a robot fell"),
        SIGNAL: EventCode("stop", "the walk is over: the world was told to stop"),
        STOPPED: EventCode("stop", "the walk is over: somebody has asked the team to stop"),
        PLANT_GONE: EventCode("stop", "the walk is over: one of several plants left or is silent"),
        CLOCK_SET: EventCode("stop", "the walk is over: somebody set a plant's system clock"),
        PLANT_FAILED: EventCode("stop", "the walk is over: the plant failed"),
        LINK_LOST: EventCode("stop", "the walk is over: the link to the router is gone"),
        LEAD_GONE: EventCode("stop", "who drives time vanished: as the recorder notes it"),
    }
)
DOWN: Final = frozenset((FALL, ROBOT_STOPPED))  # a robot that walks no more: the walk ends


def with_detail(code: str, detail: str) -> str:
    """A status or a reason to stop that has a detail: `code:detail`.

    Args:
        code: without a colon.
        detail: any text.
    """
    return f"{code}:{detail}"


def code_of(text: str) -> str:
    """The code of a plan's status or of a reason to stop; "" of none."""
    return text.partition(":")[0]
