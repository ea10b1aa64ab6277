"""SHELL: asks the processes of a team how they are, and looks at this computer."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from quadriga.doctor.certificates import check_certificates, try_certificate
from quadriga.doctor.machine import check_machine, need_of
from quadriga.doctor.readings import read_machine
from quadriga.doctor.report import DoctorReport, MemberReport
from quadriga.shared.about import About
from quadriga.shared.bus.diagnostics import (
    BAD,
    GOOD,
    NOTE,
    UNKNOWN,
    Diagnosis,
    TeamView,
    diagnose,
    disagreements,
    members,
    processes,
)
from quadriga.shared.bus.discovery import ask, ask_clock, describe_process, view_of
from quadriga.shared.bus.session import HERE, Bus, pause
from quadriga.shared.bus.settings import OPEN, REFUSED, UNTRIED, Reach, try_endpoint
from quadriga.shared.config.endpoints import is_loopback, is_tls
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, QuadrigaError
from quadriga.shared.members import DOCTOR, SIM, Member
from quadriga.shared.runtime.clock import monotonic, utc_now
from quadriga.shared.runtime.installed import project_version

LINK: Final = "link"
_LINK_TIMEOUT: Final = 2.0  # s, in which a link to those that are there has come about
_SETTLE: Final = 1.0  # s more, in which the presence of all of them becomes known


def examine(config: Config, *, here: bool) -> DoctorReport:
    """Look at the team of a configuration and at this computer; nothing is changed.

    Args:
        config: the team's configuration, as this computer has it.
        here: look at this computer alone.

    Raises:
        BusError: the endpoint is malformed.
    """
    endpoint, team = config.bus.endpoint, config.team.name
    need = need_of(config, spread=not is_loopback(endpoint))
    machine = (*check_machine(read_machine(), need), *check_certificates(config, utc_now()))
    if here:
        link = _judge_reach(try_endpoint(endpoint), waiting=True)
        return DoctorReport(team, endpoint, project_version(), link, machine)
    me = describe_process(config, DOCTOR)
    view, link = _look_at_team(config, me)
    found = tuple(_report(member, view, config) for member in processes(config))
    return DoctorReport(
        team, endpoint, me.version, link, (*disagreements(me, view), *machine), found
    )


def _report(member: Member, view: TeamView, config: Config) -> MemberReport:
    """What is to be said of a member; of one that is not there also whether it could come in."""
    answers, found = view.answers.get(member.name, ()), diagnose(member, view)
    if not answers:
        found += tuple(try_certificate(config, member.name))
    return MemberReport(member.name, answers, found)


def _look_at_team(config: Config, me: About) -> tuple[TeamView, Diagnosis]:
    """What is seen of a team without being one of it, and how it is reached."""
    nobody = frozenset[str]()
    view = TeamView(False, nobody, nobody, members(config))
    try:
        bus = Bus.open(config.bus, config.team.name, DOCTOR)
    except QuadrigaError as error:
        if is_tls(config.bus.endpoint):  # no certificate, or a handshake has told why
            return view, Diagnosis(LINK, BAD, f"{error.name}: {error.got}", error.cause)
        reach = try_endpoint(config.bus.endpoint)
        if reach.code == UNTRIED or isinstance(error, ConfigError):
            raise
        return view, _judge_reach(reach, waiting=False)
    with bus:
        bus.wait_for_link(_LINK_TIMEOUT)
        deadline = monotonic() + _SETTLE
        while bus.linked and not members(config) <= bus.members_at(HERE):
            if monotonic() > deadline:
                break
            pause()
        view = _compare_clocks(bus, config, view_of(bus, config, ask(bus), me))
    if view.linked:
        return view, Diagnosis(LINK, GOOD, f"linked by {config.bus.endpoint}")
    return view, _judge_reach(try_endpoint(config.bus.endpoint), waiting=False)


def _compare_clocks(bus: Bus, config: Config, view: TeamView) -> TeamView:
    """The same view, with those answers of plants that tell best what their clocks show."""
    if not config.team.plant_per_robot or config.world.mode != "realtime":
        return view
    plants = [member.name for member in processes(config) if member.role.name == SIM]
    alone = [name for name in plants if len(view.answers.get(name, ())) == 1]
    nearest = {name: [answer] for name in alone if (answer := ask_clock(bus, name)) is not None}
    return replace(view, answers={**view.answers, **nearest})


def _judge_reach(reach: Reach, *, waiting: bool) -> Diagnosis:
    """What an attempt to connect says of the way to a team.

    Args:
        reach: what came of it.
        waiting: whether it is enough that the way is open, or would be if somebody listened.
    """
    remedy = (
        "start who drives time (sim, or the bridge of r1), or the router; is bus.endpoint right?"
    )
    if reach.code == UNTRIED:
        return Diagnosis(LINK, UNKNOWN, reach.text)
    if reach.code == REFUSED:
        return Diagnosis(LINK, NOTE if waiting else BAD, reach.text, remedy)
    if reach.code != OPEN:
        return Diagnosis(
            LINK, BAD, reach.text, "are both in one network, and is bus.endpoint right?"
        )
    if waiting:
        return Diagnosis(LINK, GOOD, reach.text)
    text = f"{reach.text}, but there is no link"
    return Diagnosis(LINK, BAD, text, "another program, or with tls/ one side is not trusted")
