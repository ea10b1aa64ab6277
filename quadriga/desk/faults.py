"""What is made to go wrong while a team walks through bridges, one thing at a time."""

from __future__ import annotations

import signal
from typing import Final, NamedTuple

PLANT, AGENT, WATCHDOG, ROUTER = "plant", "agent", "watchdog", "router"


class Fault(NamedTuple):
    """One thing that goes wrong.

    Attributes:
        name: on the command line and in tables.
        what: in words.
        orders: commands to the emulated robot, without its name.
        processes: get `signal`: `PLANT`, `AGENT`, `WATCHDOG` of the robot, or `ROUTER`.
        signal: SIGKILL or SIGSTOP.
        robot: whose fault it is: "" is any of them.
    """

    name: str
    what: str
    orders: tuple[str, ...] = ()
    processes: tuple[str, ...] = ()
    signal: signal.Signals = signal.SIGKILL
    robot: str = ""


_STOP: Final = signal.SIGSTOP
FAULTS: Final = (
    Fault("agent-killed", "the agent's process is killed", processes=(AGENT,)),
    Fault("agent-frozen", "the agent's process stands still", processes=(AGENT,), signal=_STOP),
    Fault("bus-cut", "the router is killed: nobody hears anybody", processes=(ROUTER,)),
    Fault("bridge-killed", "the bridge's process is killed", processes=(PLANT,), robot="r2"),
    Fault("bridge-frozen", "the bridge's process stands still", (), (PLANT,), _STOP, "r2"),
    Fault(
        "computer-lost", "bridge and watchdog are killed at once", (), (WATCHDOG, PLANT), robot="r2"
    ),
    Fault("leader-killed", "the bridge that leads the clock is killed", (), (PLANT,), robot="r1"),
    Fault("leader-frozen", "it stands still", (), (PLANT,), _STOP, "r1"),
    Fault("loss-1", "1 % of the robot's packets are lost, both ways", ("loss 0.01",)),
    Fault("loss-5", "5 %", ("loss 0.05",)),
    Fault("loss-20", "20 %", ("loss 0.2",)),
    Fault("delay-5", "all of them come 5 ms later", ("delay 5",)),
    Fault("delay-20", "20 ms later", ("delay 20",)),
    Fault("duplicated", "a fifth of them come twice", ("duplicate 0.2",)),
    Fault("reordered", "a fifth of them come after the next", ("reorder 0.2",)),
    Fault("garbage", "a fifth of them are damaged", ("garbage 0.2",)),
    Fault("second-writer", "another process commands the motors", ("writer",)),
    Fault("remote-stop", "L2+B is pressed on the remote control", ("remote L2+B",)),
    Fault("battery-low", "the battery falls to 5 %", ("battery 5",)),
    Fault("motor-protected", "a knee's motor switches itself off", ("protect FR_calf_joint",)),
)
"""In the order of the table."""
BY_NAME: Final = {fault.name: fault for fault in FAULTS}
NO_FAULT: Final = Fault("none", "nothing goes wrong")
