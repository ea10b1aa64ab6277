"""The start-up barrier: nobody walks before everybody is there, linked and warmed up.

Nor before all have said that they have the same version, configuration and predictor. A process
that is started again joins its team as it walks.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Final

from quadriga.shared.bus.inquiry import Pause, check_oneself, check_others, pause
from quadriga.shared.bus.introduction import Introduction
from quadriga.shared.bus.roster import lead as lead
from quadriga.shared.bus.roster import members as members
from quadriga.shared.bus.roster import processes as processes
from quadriga.shared.bus.watch import Watch, say
from quadriga.shared.bus.zenoh_bus import HERE, READY, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import LEADS, OPERATOR, RECORDER, SIM, has_lead
from quadriga.shared.runtime.clock import sleep

STARTS: Final = "starts"  # with its team
REJOINS: Final = "rejoins"  # a team that walks
_SETTLE: Final = 0.2  # s, in which all who are there become known, maybe one of the same name


def meet(
    bus: Bus, config: Config, stopped: Callable[[], bool], me: Introduction | None = None
) -> bool:
    """Announce this process, whose subscribers are declared, and wait until all others are here.

    A token is seen over the link its process uses for everything else, behind its subscriptions:
    whoever is seen will receive what is published from now on. False if `stopped()` came first.

    Args:
        bus: this process's.
        config: the team's configuration.
        stopped: asked often whether to stop.
        me: what this process says of itself; by default that it has no predictor.

    Raises:
        BusError: some did not come in time, the team walks already, has such a member already, or
            has another version, configuration or predictor.
    """
    me = me or Introduction(bus, config)
    joined = _await_team(bus, config, stopped)
    if joined == REJOINS:
        cause = "another team.name or bus.endpoint is needed"
        raise _walks_already(bus, config, cause)
    return bool(joined) and _introduce(bus, config, me)


def join(
    bus: Bus, config: Config, stopped: Callable[[], bool], me: Introduction | None = None
) -> str:
    """As `meet`, but take part in a team that walks already: `STARTS` or `REJOINS`.

    "" if `stopped()` came first. In lock-step only an operator or a recorder may be started again:
    what an agent does depends on all that it has heard since the begin of the walk.

    Raises:
        BusError: as `meet`; or an agent is started again in lock-step.
    """
    me = me or Introduction(bus, config)
    joined = _await_team(bus, config, stopped)
    lockstep = config.world.mode == "lockstep"
    if joined == REJOINS and lockstep and bus.name not in (OPERATOR, RECORDER):
        cause = "in lock-step no agent can be started again: start the whole team"
        raise _walks_already(bus, config, cause)
    if not joined or not _introduce(bus, config, me):
        return ""
    if joined == REJOINS:
        say(f"{bus.name} joins team {bus.team!r}, which walks")
    return joined


def _await_team(bus: Bus, config: Config, stopped: Callable[[], bool]) -> str:
    """Announce this process and wait until all are here, or the team is seen to walk."""

    def walks() -> bool:
        return has_lead(bus.members_at(READY))

    bus.declare(HERE)
    say(f"{bus.name} of team {bus.team!r} is at {config.bus.endpoint}, waits until all are there")
    here = await_members(bus, config, HERE, members(config), lambda: stopped() or walks())
    if stopped():
        return ""
    if here:
        say(f"{bus.name}: all {len(members(config))} processes are there")
        pause()  # who is ready has said so right behind that it is here
    if not walks():
        return STARTS
    sleep(_SETTLE)
    return REJOINS


def _introduce(bus: Bus, config: Config, me: Introduction) -> bool:
    """See that this process is alone of its name, and has the same in common with the others."""
    _check_single(bus, config)
    check_oneself(bus, config, me.about, say)
    me.met = True
    return True


def _walks_already(bus: Bus, config: Config, cause: str) -> BusError:
    team = f"team {bus.team!r} at {config.bus.endpoint}"
    return BusError(team, "a team that walks already", "a network without this team", cause)


def await_members(
    bus: Bus,
    config: Config,
    stage: str,
    names: Collection[str],
    stopped: Callable[[], bool],
    wait: Pause = pause,
) -> bool:
    """Wait until all `names` are at `stage`; False if `stopped()` came first.

    When that takes long this says on stderr who is awaited and why. Meanwhile `wait()` is called
    all the time.

    Raises:
        BusError: some were not there in time; the message says why of each.
    """
    watch = Watch(bus, config, stage, names, wait)
    timeout = config.bus.barrier_timeout
    return bus.wait_for(stage, names, timeout, stopped, watch.pause, watch.explain)


def await_agents(bus: Bus, config: Config, stopped: Callable[[], bool]) -> bool:
    """A robot's wait until all but plants are ready: only then it stands up.

    False if `stopped()` came first.

    Raises:
        BusError: some were not ready in time, or do not belong to this team.
    """
    names = {member.name for member in processes(config) if member.role.name != SIM}
    if not await_members(bus, config, READY, names, stopped):
        return False
    check_others(bus, config, names)
    return True


def start_together(
    bus: Bus, config: Config, stopped: Callable[[], bool], wait: Pause | None = None
) -> bool:
    """A plant's wait until all others are ready; the one that drives time starts the team.

    False if `stopped()` came first. While it waits, `wait()` is called all the time.

    Raises:
        BusError: some were not ready in time, two carry one name, or some do not belong to this
            team.
    """
    wait, names = wait or pause, members(config)
    if bus.name not in LEADS:
        bus.declare(READY)
    if not await_members(bus, config, READY, names, stopped, wait):
        return False
    _check_single(bus, config)
    if bus.name in LEADS:
        check_others(bus, config, names, wait)
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
