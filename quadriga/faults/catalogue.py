"""The table of what can be made to go wrong in a team that walks in the simulated world."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from typing import Final, NamedTuple

from quadriga.shared.errors import ConfigError, did_you_mean
from quadriga.shared.members import OPERATOR, RECORDER, ROUTER, SIM
from quadriga.sim_server.world.faults.fault import KINDS

OWN: Final = "robot"  # in place of a process: the agent of the robot that the seed draws
ALL: Final = "all"
_PAUSE_S: Final = 0.3  # of a process that stands still for a while
_SHORT_S: Final = 0.5  # of a component that is faulty for a while
_KILL: Final = ((signal.SIGKILL, 0.0),)
_STOP: Final = ((signal.SIGSTOP, 0.0),)
_PAUSE: Final = ((signal.SIGSTOP, 0.0), (signal.SIGCONT, _PAUSE_S))


class TeamFault(NamedTuple):
    """One thing that goes wrong. It is of a process or of a component, never of both.

    Attributes:
        name: on the command line and in tables.
        what: in words.
        process: gets the signals; `OWN`, or a process of the team by its name.
        signals: what it gets, each with the time since the first, s.
        component: of the robot that the seed draws, with the kind of its fault, as in
            `world.faults`.
        seconds: how long the component is faulty; None: from then on.
    """

    name: str
    what: str
    process: str = ""
    signals: tuple[tuple[signal.Signals, float], ...] = ()
    component: str = ""
    seconds: float | None = None

    @property
    def realtime(self) -> bool:
        """Whether it is tried in real time: processes are, components are in lock-step."""
        return bool(self.process)


def _of_components() -> list[TeamFault]:
    found = list[TeamFault]()
    for component, seconds in (("imu", _SHORT_S), ("encoder_FL_calf", _SHORT_S), ("feet", None)):
        for kind in KINDS:
            time = "for good" if seconds is None else f"for {seconds:g} s"
            name, what = f"{component}-{kind}", f"{component} {kind} {time}"
            found.append(TeamFault(name, what, component=f"{component} {kind}", seconds=seconds))
    for kind in KINDS:
        what = f"a knee's motor {kind} for {_SHORT_S:g} s"
        found.append(
            TeamFault(f"knee-{kind}", what, component=f"motor_FL_calf {kind}", seconds=_SHORT_S)
        )
    return found


FAULTS: Final = (
    TeamFault("agent-killed", "an agent's process is killed", OWN, _KILL),
    TeamFault("agent-frozen", "an agent's process stands still", OWN, _STOP),
    TeamFault("agent-paused", f"it stands still for {_PAUSE_S:g} s", OWN, _PAUSE),
    TeamFault("operator-killed", "the operator's process is killed", OPERATOR, _KILL),
    TeamFault("operator-frozen", "it stands still", OPERATOR, _STOP),
    TeamFault("operator-paused", f"it stands still for {_PAUSE_S:g} s", OPERATOR, _PAUSE),
    TeamFault("recorder-killed", "the recorder is killed", RECORDER, _KILL),
    TeamFault("recorder-paused", f"it stands still for {_PAUSE_S:g} s", RECORDER, _PAUSE),
    TeamFault("sim-paused", f"the world stands still for {_PAUSE_S:g} s", SIM, _PAUSE),
    TeamFault("router-killed", "the router is killed: nobody hears anybody", ROUTER, _KILL),
    TeamFault("router-paused", f"it stands still for {_PAUSE_S:g} s", ROUTER, _PAUSE),
    *_of_components(),
)
"""In the order of the table."""
BY_NAME: Final = {fault.name: fault for fault in FAULTS}


def select_faults(names: Sequence[str]) -> list[TeamFault]:
    """Faults by their names, or all, in the order of the table.

    Raises:
        ConfigError: there is no such fault.
    """
    for name in names:
        if name != ALL and name not in BY_NAME:
            hint = did_you_mean(name, BY_NAME)
            raise ConfigError("fault", repr(name), f"all, {', '.join(BY_NAME)}", hint)
    return [fault for fault in FAULTS if ALL in names or fault.name in names]
