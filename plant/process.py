"""SHELL of a plant: receives the robots' commands, steps the plant, sends what it measures."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing, nullcontext
from typing import Final

from quadriga.plant.loops import TeamPace, run_lockstep, run_realtime
from quadriga.plant.protocol import TOLD_TO_STOP, End, Plant
from quadriga.plant.requests import find_estop, subscribe_requests
from quadriga.plant.server import PlantServer
from quadriga.shared import codes
from quadriga.shared.bus.discovery import ProcessInfo, await_agents, join, start_together
from quadriga.shared.bus.liveness import Loss, loss_error
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.members import plant_name
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.scheduling import end_collection, leave_priority, take_priority
from quadriga.shared.runtime.signals import interruptible, stop_on_signals

_ALL_STOP: Final = 1.0  # s, in which a team is stopped whose processes get the signal one by one

# What was expected, and what the cause may be, by the code of an end.
_BAD_ENDS: Final = {
    codes.PLANT_FAILED: (
        "a simulation that stays bounded",
        "gains, loads, pushes or faults that no simulation follows",
    ),
    codes.COMMAND_LOST: (
        "commands of all robots until the end",
        "the agent failed, was stopped, or its computer is too slow: see what it says itself",
    ),
    codes.PLANT_GONE: (
        "the plants of all robots until the end",
        "it failed, was stopped, or lost its link: see what it says itself",
    ),
}

PlantFactory = Callable[[Config, tuple[str, ...]], Plant]


def run(
    config: Config, build: PlantFactory, robot: str = "", stopped: Callable[[], bool] | None = None
) -> None:
    """Be the plant until `world.duration` are over, a robot has fallen, or it is stopped.

    The others learn of the end from the event `stop`, and from the absence of the process that
    drives time.

    Args:
        config: the team's configuration.
        build: makes the plant of the robots with these names.
        robot: the robot that this process is the plant of; "": of all.
        stopped: asked often whether to stop; by default a flag that SIGINT and SIGTERM raise.

    Raises:
        ConfigError: the plant cannot be built from the configuration.
        BusError: the bus cannot be opened, or the team is not complete in time.
        ProcessError: another plant, an agent, or the link to the router vanished while the team
            walked.
        KeyboardInterrupt: it is stopped before its plant is built.
    """
    stopped = stopped or stop_on_signals()
    team, realtime = config.team.name, config.world.mode == "realtime"
    # A bridge opens sockets and starts its watchdog, which are not left half made.
    with nullcontext() if config.team.plant == BRIDGED else interruptible(stopped):
        plant = build(config, (robot,) if robot else robot_names(config.team.robots))
    with Bus.open(config.bus, team, plant_name(robot), stopped) as bus:
        with interruptible(stopped):
            server = PlantServer(config, plant, bus, robot)
        for key in sorted(server.time.keys):
            bus.subscribe(key)
        server.requests = subscribe_requests(bus)
        if plant.is_robot:
            estops = subscribe_requests(bus)
            plant.listen(lambda: find_estop(estops()), server.take_event)
        me = ProcessInfo(bus, config)
        with closing(server.link):
            server.link.open()
            if not join(bus, config, stopped, me):
                return
            pace = TeamPace(bus, config, me) if robot and realtime else None
            _walk(server, pace, stopped)
    _check_end(server.time.end, team, plant.tick)


def _walk(server: PlantServer, pace: TeamPace | None, stopped: Callable[[], bool]) -> None:
    """Start the team, walk, and tell everybody why it is over."""
    end_collection()
    take_priority(server.config.runtime.priority)
    try:
        if not _start(server, pace, stopped):
            end = TOLD_TO_STOP
        elif server.config.world.mode == "realtime":
            end = run_realtime(server, stopped, pace)
        else:
            end = run_lockstep(server, stopped)
        if end.code == codes.COMMAND_LOST and _is_stopped_soon(stopped):
            end, server.time.end = TOLD_TO_STOP, None
        server.publish_batch()
        if server.time.drives:
            server.announce(end.code, "", end.detail)
        server.link.close(end.code)
    except Exception as error:
        if server.time.drives:  # then the others need not find out by themselves
            server.announce(codes.PLANT_FAILED, "", f"{type(error).__name__}: {error}")
        server.link.close(codes.PLANT_FAILED)
        raise
    finally:
        server.plant.finish()
        leave_priority()


def _is_stopped_soon(stopped: Callable[[], bool]) -> bool:
    """Whether this process is stopped too, as the agent was whose commands are missing."""
    deadline = monotonic() + _ALL_STOP
    while not stopped() and monotonic() < deadline:
        _pause()
    return stopped()


def _start(server: PlantServer, pace: TeamPace | None, stopped: Callable[[], bool]) -> bool:
    """Get the robots to stand, and start the team; False if `stopped()` came first."""
    bus, config, plant = server.bus, server.config, server.plant
    if pace is not None:
        pace.check_clock()
    if plant.is_robot and not await_agents(bus, config, stopped):
        return False
    if not plant.prepare(stopped):
        return False
    wait = plant.idle if plant.is_robot else _pause
    if not start_together(bus, config, stopped, wait):
        return False
    return pace is None or pace.start(wait, stopped)


def _pause() -> None:
    sleep(0.002)


def _check_end(end: End | None, team: str, tick: int) -> None:
    """Complain if the walk was over for this plant because something vanished.

    Raises:
        ProcessError: another plant, or the link to the router; or the simulation is unstable; or
            the system clock was set, by which plants of single robots go.
    """
    if end is None:
        return
    if end.code == codes.LINK_LOST:
        raise loss_error(Loss(*end), tick)
    if end.code in _BAD_ENDS:
        raise ProcessError(f"team {team!r} at {tick} ms", end.detail, *_BAD_ENDS[end.code])
