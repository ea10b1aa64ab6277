"""The start-up barrier: nobody walks before everybody is there, linked and warmed up."""

from __future__ import annotations

from collections.abc import Callable

from quadriga.shared.bus.zenoh_bus import HERE, READY, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import LEADS, SIM, Member, has_lead, team_members
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robot.conventions import robot_names


def processes(config: Config) -> tuple[Member, ...]:
    """All processes of a team, in the order of the table of processes."""
    return team_members(
        robot_names(config.team.robots),
        central=find_kind(config.planner.kind).central,
        recorded=config.recorder.enabled,
        plant_each=config.team.plants == "each",
    )


def members(config: Config) -> frozenset[str]:
    """Names of all processes of a team."""
    return frozenset(member.name for member in processes(config))


def lead(config: Config) -> str:
    """Name of the process that drives the team's time, with which all others leave."""
    return next(member.name for member in processes(config) if member.name in LEADS)


def meet(bus: Bus, config: Config, stopped: Callable[[], bool]) -> bool:
    """Announce this process, whose subscribers are declared, and wait until all others are here.

    A token is seen over the link its process uses for everything else, behind its subscriptions:
    whoever is seen will receive what is published from now on. False if `stopped()` came first.

    Raises:
        BusError: some did not come in time, the team walks already, or has such a member already.
    """
    bus.declare(HERE)
    present = bus.wait_for(HERE, members(config), config.bus.barrier_timeout, stopped)
    if present and has_lead(bus.members_at(READY)):
        raise BusError(
            f"team {bus.team!r} at {config.bus.endpoint}",
            "a team that walks already",
            "a network without this team",
            "another team.name or bus.endpoint is needed",
        )
    _check_single(bus, config)
    return present


def await_agents(bus: Bus, config: Config, stopped: Callable[[], bool]) -> bool:
    """A robot's wait until all but plants are ready: only then it stands up.

    False if `stopped()` came first.

    Raises:
        BusError: some were not ready in time.
    """
    names = {member.name for member in processes(config) if member.role.name != SIM}
    return bus.wait_for(READY, names, config.bus.barrier_timeout, stopped)


def start_together(
    bus: Bus, config: Config, stopped: Callable[[], bool], pause: Callable[[], None] | None = None
) -> bool:
    """A plant's wait until all others are ready; the one that drives time starts the team.

    False if `stopped()` came first. While it waits, `pause()` is called all the time.

    Raises:
        BusError: some were not ready in time, or two carry one name.
    """
    if bus.name not in LEADS:
        bus.declare(READY)
    waiting = {} if pause is None else {"pause": pause}
    if not bus.wait_for(READY, members(config), config.bus.barrier_timeout, stopped, **waiting):
        return False
    _check_single(bus, config)
    bus.declare(READY)
    return True


def _check_single(bus: Bus, config: Config) -> None:
    if duplicates := bus.duplicates(HERE):
        raise BusError(
            f"team {bus.team!r} at {config.bus.endpoint}",
            f"two processes named {', '.join(sorted(duplicates))}",
            "one of each name",
            "a second team with this team.name, or a process started twice",
        )
