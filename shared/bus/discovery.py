"""The start-up barrier: nobody walks before everybody is there, linked, warmed up and agrees.

All processes ask each other who they are. Who differs in version, configuration or predictor leaves
by itself, and who drives the team's time starts no team in which one differs or does not answer.
Nobody joins a team that walks.
"""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Final

from quadriga.shared.about import ABOUT, STAGES, STARTED, About, scheduling_of, stage_of
from quadriga.shared.bus.diagnostics import (
    MemberAnswer,
    TeamNorm,
    TeamView,
    describe_absent,
    disagreements,
    first_predicting,
    lead,
    members,
    processes,
    refuse,
)
from quadriga.shared.bus.session import HERE, READY, Bus, pause
from quadriga.shared.bus.settings import describe_way
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import agreed_keys
from quadriga.shared.errors import BusError, MessageError
from quadriga.shared.members import LEADS, RECORDER, SIM, has_lead
from quadriga.shared.runtime.clock import monotonic, wall_ns
from quadriga.shared.runtime.installed import (
    PROJECT,
    code_digest,
    package_versions,
    project_version,
)
from quadriga.shared.runtime.scheduling import REALTIME, has_priority
from quadriga.shared.schema import message_forms

Pause = Callable[[], None]
Answered = dict[str, list[MemberAnswer]]

ALL: Final = ("*",)  # ask everybody
_TIMEOUT: Final = 1.0  # s, for an answer: whoever is not frozen gives it within milliseconds
_GRACE: Final = 0.5  # s more, after which nothing is awaited whatever the bus says
_PATIENCE: Final = 3.0  # s, in which those that do not answer are asked again
_BETWEEN: Final = 0.1  # s, between two questions to one that does not answer
_CLOCK_ASKS: Final = 8  # of which that with the shortest round trip tells a clock best
_QUIET: Final = 2.0  # s of waiting that are not logged
_EVERY: Final = 5.0  # s, between two looks at those that are awaited


def log(text: str) -> None:
    """Write a line into this process's log."""
    print(f"quadriga: {text}", file=sys.stderr, flush=True)


class ProcessInfo:
    """What this process answers from now on to whoever asks who it is, as it is at that moment.

    Args:
        bus: this process's.
        config: the configuration that it has.
        predictor_sha256: digest of the predictor that it has; "": none.

    Attributes:
        met: whether this process has seen that all are here.
        start_ns: when tick 0 begins by the system clock, of the plant that drives time for others.
    """

    def __init__(self, bus: Bus, config: Config, predictor_sha256: str = "") -> None:
        self._bus = bus
        # A recorder never asks for it; in lock-step nobody needs it.
        paced = config.world.mode == "realtime" and bus.name != RECORDER
        self._wanted = paced and config.runtime.priority == REALTIME
        self._fixed = describe_process(config, bus.name, predictor_sha256)
        self.met, self.start_ns = False, 0
        bus.answer(ABOUT.key(bus.team, bus.name), lambda: encode(self.about))

    @property
    def about(self) -> About:
        """What this process says of itself now."""
        stage = stage_of(self._bus.reached, met=self.met)
        return replace(
            self._fixed,
            stage=stage,
            scheduling=scheduling_of(wanted=self._wanted, granted=has_priority(), stage=stage),
            sees=tuple(sorted(self._bus.members_at(HERE))),
            wall_ns=wall_ns(),
            start_ns=self.start_ns,
        )


def describe_process(config: Config, name: str, predictor_sha256: str = "") -> About:
    """What does not change of what a process says of itself."""
    versions, no_library = package_versions(), ("machine", PROJECT)
    return About(
        tick=0,
        stamp_ns=0,
        name=name,
        host=socket.gethostname(),
        pid=os.getpid(),
        version=project_version(),
        code=code_digest(),
        libraries=tuple(f"{k} {v}" for k, v in versions.items() if k not in no_library),
        config=agreed_keys(config),
        messages=message_forms(),
        predictor=predictor_sha256,
        stage=STARTED,
        scheduling=scheduling_of(wanted=False, granted=False, stage=STARTED),
        sees=(),
        wall_ns=0,
        start_ns=0,
    )


def ask(bus: Bus, names: Collection[str] = ALL, wait: Pause = pause) -> Answered:
    """What processes say of themselves, by name, once all have answered or a second has passed.

    Args:
        bus: where they are.
        names: whom to ask.
        wait: called all the time meanwhile; takes some milliseconds.
    """
    questions = [bus.ask(ABOUT.key(bus.team, name), _TIMEOUT) for name in names]
    deadline = monotonic() + _TIMEOUT + _GRACE
    while not all(question.over for question in questions) and monotonic() < deadline:
        wait()
    answered: Answered = {}
    for question in questions:
        for arrived_ns, key, payload in question.take():
            name = key.split("/")[1]
            answer = MemberAnswer(read_about(name, payload), question.asked_ns, arrived_ns)
            answered.setdefault(name, []).append(answer)
    return answered


def ask_clock(bus: Bus, name: str, wait: Pause = pause) -> MemberAnswer | None:
    """Of some answers of a process that with the shortest round trip; None if it gives none.

    Args:
        bus: where it is.
        name: whom to ask; of two processes of this name the nearer one answers.
        wait: called all the time meanwhile; takes some milliseconds.
    """
    received = list[MemberAnswer]()
    for _ in range(_CLOCK_ASKS):
        new = [item for item in ask(bus, (name,), wait).get(name, ()) if item.about is not None]
        if not new:  # to ask one that is frozen takes a second
            break
        received += new
    return min(received, key=lambda item: item.clock_offset.error, default=None)


def read_about(name: str, payload: bytes) -> About | None:
    """What a process says of itself; None if it cannot be read, or is not about this process."""
    try:
        about = decode(payload, About)
    except MessageError:
        return None
    texts = (about.host, about.version, about.code, about.predictor, *about.libraries)
    plain = all(text.isprintable() for text in (*texts, *about.config, *about.sees))
    return about if plain and about.name == name and about.stage in STAGES else None


def view_of(
    bus: Bus, config: Config, answered: Answered, fallback: About | None = None
) -> TeamView:
    """What a process sees of its team: who is on the bus, and what they have said.

    Args:
        bus: its own.
        config: the one it has.
        answered: what `ask` has given.
        fallback: with what all are compared where the process that drives time says nothing.
    """
    linked = bus.linked or bus.name in LEADS  # to whom all others link
    view = TeamView(linked, bus.members_at(HERE), bus.duplicates(HERE), members(config), answered)
    leader, planner = view.about(lead(config)) or fallback, first_predicting(config)
    if leader is None:
        return view
    plans = view.about(planner)
    return replace(view, norm=TeamNorm(leader, plans.predictor if plans else "", planner))


def join(
    bus: Bus, config: Config, stopped: Callable[[], bool], info: ProcessInfo | None = None
) -> bool:
    """Announce this process, whose subscribers are declared, and wait until all others are here.

    A token is seen over the link its process uses for everything else, behind its subscriptions:
    whoever is seen will receive what is published from now on.

    Args:
        bus: this process's.
        config: the team's configuration.
        stopped: asked often whether to stop.
        info: what this process says of itself; by default that it has no predictor.

    Returns:
        False if `stopped()` came first.

    Raises:
        BusError: some did not come in time, the team walks already, has such a member already, or
            has another version, configuration or predictor.
    """
    info = info or ProcessInfo(bus, config)

    def walks() -> bool:
        return has_lead(bus.members_at(READY))

    bus.declare(HERE)
    log(f"{bus.name} of team {bus.team!r} is at {config.bus.endpoint}, waits until all are there")
    here = await_members(bus, config, HERE, members(config), lambda: stopped() or walks())
    if stopped():
        return False
    if here:
        log(f"{bus.name}: all {len(members(config))} processes are there")
        pause()  # who is ready has said so right behind that it is here
    if walks():
        team, cause = f"team {bus.team!r} at {config.bus.endpoint}", "start the whole team again"
        raise BusError(team, "a team that walks already", "a network without this team", cause)
    _check_single(bus, config)
    _check_oneself(bus, config, info.about)
    info.met = True
    return True


def await_members(
    bus: Bus,
    config: Config,
    stage: str,
    names: Collection[str],
    stopped: Callable[[], bool],
    wait: Pause = pause,
) -> bool:
    """Wait until all `names` are at `stage`; False if `stopped()` came first.

    When that takes long this logs who is awaited and why. Meanwhile `wait()` is called
    all the time.

    Raises:
        BusError: some were not there in time; the message says why of each.
    """
    due, logged = monotonic() + _QUIET, ""

    def describe(absent: Collection[str]) -> tuple[str, bool]:
        """Why some are not there, and whether this process is linked to anybody."""
        view = view_of(bus, config, ask(bus, wait=wait), describe_process(config, bus.name))
        awaited = [member for member in processes(config) if member.name in absent]
        return describe_absent(awaited, view), view.linked

    def wait_and_log() -> None:
        nonlocal due, logged
        wait()
        if monotonic() < due:
            return
        absent = frozenset(names) - {bus.name} - bus.members_at(stage)
        reasons = describe(absent)[0] if absent else logged
        if reasons != logged:
            log(f"{bus.name} waits; {reasons}")
        due, logged = monotonic() + _EVERY, reasons

    def explain(absent: Collection[str]) -> str:
        """The same in one line; takes a second if one of those there is frozen."""
        reasons, linked = describe(absent)
        # Only now, at the end: to try it may take a second in which a robot would not be attended.
        return reasons if linked else f"{reasons}; {describe_way(config.bus, bus.name)}"

    timeout = config.bus.barrier_timeout
    return bus.wait_for(stage, names, timeout, stopped, wait_and_log, explain)


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


def check_others(bus: Bus, config: Config, names: Collection[str], wait: Pause = pause) -> None:
    """Refuse to walk with others that differ, or do not say what they are.

    A controller of one's own need not say it; one that does must not differ.

    Args:
        bus: this process's, which drives time or is the plant of a robot.
        config: its configuration.
        names: the others.
        wait: called all the time while they are asked.

    Raises:
        BusError: one differs, or gives no answer; the message names it and in what it differs.
    """
    others, answered = sorted({*names} - {bus.name}), ask(bus, wait=wait)
    foreign = {member.name for member in processes(config) if member.foreign}
    deadline = monotonic() + _PATIENCE
    while (silent := {*others} - {*answered} - foreign) and monotonic() < deadline:
        again = monotonic() + _BETWEEN
        while monotonic() < again:
            wait()
        answered |= ask(bus, sorted(silent), wait)
    view = view_of(bus, config, answered, describe_process(config, bus.name))
    for name in others:
        if name in foreign and name not in answered:
            continue
        about = view.about(name)
        if about is None or view.norm is None:
            raise BusError(
                f"{name} of team {bus.team!r}",
                f"no answer that can be read within {_PATIENCE:g} s",
                "its version and its configuration before the team walks",
                "it is frozen or overloaded, or has another version of quadriga",
            )
        refuse(name, bus.team, disagreements(about, view.norm))


def _check_single(bus: Bus, config: Config) -> None:
    if duplicates := bus.duplicates(HERE):
        raise BusError(
            f"team {bus.team!r} at {config.bus.endpoint}",
            f"two processes named {', '.join(sorted(duplicates))}",
            "one of each name",
            "a second team with this team.name, or a process started twice",
        )


def _check_oneself(bus: Bus, config: Config, about: About) -> None:
    """Leave a team whose processes have something else in common.

    Whoever differs leaves by itself, so that the others can go on waiting for the right one.
    """
    others = {lead(config), first_predicting(config)} - {bus.name, ""}
    norm = view_of(bus, config, ask(bus, sorted(others))).norm
    if norm is None:  # the process that drives time refuses later who does not answer
        return
    found = disagreements(about, norm)
    refuse(bus.name, bus.team, found)
    if any(item.of == "code" for item in found):
        log(f"{norm.lead.name} has the same version of quadriga, but other source files")
