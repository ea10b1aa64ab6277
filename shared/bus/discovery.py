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

from quadriga.shared.about import STAGES, STARTED, WARMING_UP, About, about_key
from quadriga.shared.bus.diagnostics import (
    MemberAnswer,
    TeamView,
    describe_absent,
    disagreements,
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
from quadriga.shared.members import LEADS, SIM, has_lead
from quadriga.shared.runtime.clock import monotonic, wall_ns
from quadriga.shared.runtime.installed import code_digest, project_version
from quadriga.shared.schema import message_forms

Pause = Callable[[], None]
Answered = dict[str, list[MemberAnswer]]

_TIMEOUT: Final = 1.0  # s, for an answer: whoever is not frozen gives it within milliseconds
_GRACE: Final = 0.5  # s more, after which nothing is awaited whatever the bus says
_PATIENCE: Final = 3.0  # s, in which those that do not answer are asked again
_CLOCK_ASKS: Final = 8  # of which that with the shortest round trip tells a clock best
_QUIET: Final = 2.0  # s of waiting that are not logged
_EVERY: Final = 5.0  # s, between two looks at those that are awaited


def log(text: str) -> None:
    """Write a line into this process's log."""
    print(f"quadriga: {text}", file=sys.stderr, flush=True)


class ProcessInfo:
    """What this process answers from now on to whoever asks who it is, as it is at that moment.

    Attributes:
        met: whether this process has seen that all are here.
        start_ns: when tick 0 begins by the system clock, of the plant that drives time for others.
    """

    def __init__(self, bus: Bus, config: Config, predictor_sha256: str = "") -> None:
        self._bus, self._fixed = bus, describe_process(config, bus.name, predictor_sha256)
        self.met, self.start_ns = False, 0
        bus.answer(about_key(bus.team, bus.name), lambda: encode(self.about))

    @property
    def about(self) -> About:
        """What this process says of itself now."""
        reached = self._bus.reached
        stage = WARMING_UP if self.met else HERE if HERE in reached else STARTED
        return replace(
            self._fixed,
            stage=READY if READY in reached else stage,
            sees=tuple(sorted(self._bus.members_at(HERE))),
            wall_ns=wall_ns(),
            start_ns=self.start_ns,
        )


def describe_process(config: Config, name: str, predictor_sha256: str = "") -> About:
    """What does not change of what a process says of itself; "" is the digest of no predictor."""
    return About(
        tick=0,
        stamp_ns=0,
        name=name,
        host=socket.gethostname(),
        pid=os.getpid(),
        version=project_version(),
        code=code_digest(),
        config=agreed_keys(config),
        messages=message_forms(),
        predictor=predictor_sha256,
        stage=STARTED,
        sees=(),
        wall_ns=0,
        start_ns=0,
    )


def ask(bus: Bus, names: Collection[str] = ("*",), wait: Pause = pause) -> Answered:
    """What processes say of themselves, by name, once all have answered or a second has passed.

    By default everybody is asked. Meanwhile `wait()` is called all the time, some ms each.
    """
    questions = [bus.ask(about_key(bus.team, name), _TIMEOUT) for name in names]
    deadline = monotonic() + _TIMEOUT + _GRACE
    while not all(question.over for question in questions) and monotonic() < deadline:
        wait()
    answered: Answered = {}
    for question in questions:
        for arrived_ns, key, payload in question.came:
            name = key.split("/")[1]
            answer = MemberAnswer(read_about(name, payload), question.asked_ns, arrived_ns)
            answered.setdefault(name, []).append(answer)
    return answered


def ask_clock(bus: Bus, name: str) -> MemberAnswer | None:
    """Of some answers of a process that with the shortest round trip; None if it gives none.

    Of two processes of this name the nearer one answers.
    """
    received = list[MemberAnswer]()
    for _ in range(_CLOCK_ASKS):
        new = [item for item in ask(bus, (name,)).get(name, ()) if item.about is not None]
        if not new:  # to ask one that is frozen takes a second
            break
        received += new
    return min(received, key=lambda item: item.clock_offset[1], default=None)


def read_about(name: str, payload: bytes) -> About | None:
    """What a process says of itself; None if it cannot be read, or is not about this process."""
    try:
        about = decode(payload, About)
    except MessageError:
        return None
    texts = (about.host, about.version, about.code, about.predictor)
    plain = all(map(str.isprintable, (*texts, *about.config, *about.messages, *about.sees)))
    return about if plain and about.name == name and about.stage in STAGES else None


def view_of(
    bus: Bus, config: Config, answered: Answered, fallback: About | None = None
) -> TeamView:
    """What a process sees of its team: who is on the bus, and what `ask` has given.

    Where the process that drives time says nothing, all are compared with `fallback`.
    """
    linked = bus.linked or bus.name in LEADS  # to whom all others link
    view = TeamView(linked, bus.members_at(HERE), bus.duplicates(HERE), members(config), answered)
    return replace(view, lead=view.about(lead(config)) or fallback)


def join(
    bus: Bus, config: Config, stopped: Callable[[], bool], info: ProcessInfo | None = None
) -> bool:
    """Announce this process, whose subscribers are declared, and wait until all others are here.

    A token is seen over the link its process uses for everything else, behind its subscriptions:
    whoever is seen will receive what is published from now on.

    By default this process says of itself that it has no predictor. False if `stopped()` came
    first.

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
    # Whoever differs leaves by itself, so that the others can go on waiting for the right one.
    # The process that drives time refuses later who does not answer.
    found = [*disagreements(info.about, view_of(bus, config, ask(bus)))]
    refuse(bus.name, bus.team, found)
    for item in found:
        log(f"{bus.name} has {item.text}: {item.remedy}")
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
    begun, due, logged = monotonic(), monotonic() + _QUIET, ""
    timeout, wanted = config.bus.barrier_timeout, frozenset(names) - {bus.name}
    while absent := wanted - bus.members_at(stage):
        if stopped():
            return False
        late = monotonic() > begun + timeout
        if late or monotonic() > due:
            view = view_of(bus, config, ask(bus, wait=wait), describe_process(config, bus.name))
            reasons = describe_absent([m for m in processes(config) if m.name in absent], view)
            if late:
                # Only now: to try the way may take a second in which a robot is not attended.
                way = "" if view.linked else f"; {describe_way(config.bus, bus.name)}"
                raise BusError(
                    f"barrier of team {bus.team!r}, seen by {bus.name}",
                    f"no {', '.join(sorted(absent))} at stage {stage!r} after {timeout:g} s",
                    ", ".join(sorted(wanted)),
                    reasons + way,
                )
            if reasons != logged:
                log(f"{bus.name} waits; {reasons}")
            due, logged = monotonic() + _EVERY, reasons
        wait()
    return True


def await_agents(bus: Bus, config: Config, stopped: Callable[[], bool]) -> bool:
    """A robot's wait until all but plants are ready: only then it stands up.

    False if `stopped()` came first; raises as `start_together`.
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

    Raises:
        BusError: one differs, or gives no answer; the message names it and in what it differs.
    """
    others, answered = {*names} - {bus.name}, ask(bus, wait=wait)
    foreign = {member.name for member in processes(config) if member.foreign}
    deadline = monotonic() + _PATIENCE
    while (silent := others - {*answered} - foreign) and monotonic() < deadline:
        wait()
        answered |= ask(bus, sorted(silent), wait)
    view = view_of(bus, config, answered, describe_process(config, bus.name))
    for name in sorted(others):
        about = view.about(name)
        if about is not None:
            refuse(name, bus.team, disagreements(about, view))
        elif name not in foreign or name in answered:
            raise BusError(
                f"{name} of team {bus.team!r}",
                f"no answer that can be read within {_PATIENCE:g} s",
                "its version and its configuration before the team walks",
                "it is frozen or overloaded, or has another version of quadriga",
            )


def _check_single(bus: Bus, config: Config) -> None:
    if duplicates := bus.duplicates(HERE):
        raise BusError(
            f"team {bus.team!r} at {config.bus.endpoint}",
            f"two processes named {', '.join(sorted(duplicates))}",
            "one of each name",
            "a second team with this team.name, or a process started twice",
        )
