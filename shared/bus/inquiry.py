"""Asks the processes of a team who they are, and refuses those that do not belong together."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Final

from quadriga.shared.bus.absence import MemberAnswer, TeamView
from quadriga.shared.bus.agreement import CODE, TeamNorm, disagreements, refuse
from quadriga.shared.bus.introduction import describe_process
from quadriga.shared.bus.roster import first_predicting, foreign_members, lead, members
from quadriga.shared.bus.zenoh_bus import HERE, Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError, MessageError
from quadriga.shared.members import LEADS
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.wire.about import ABOUT, STAGES, About
from quadriga.shared.wire.codec import decode

Pause = Callable[[], None]
Told = dict[str, list[MemberAnswer]]

ALL: Final = ("*",)  # ask everybody
_TIMEOUT: Final = 1.0  # s, for an answer: whoever is not frozen gives it within milliseconds
_GRACE: Final = 0.5  # s more, after which nothing is awaited whatever the bus says
_PATIENCE: Final = 3.0  # s, in which those that do not answer are asked again
_BETWEEN: Final = 0.1  # s, between two questions to one that does not answer


def pause() -> None:
    """Some milliseconds until the next look."""
    sleep(0.005)


def ask(bus: Bus, names: Collection[str] = ALL, wait: Pause = pause) -> Told:
    """What processes say of themselves, by name, once all have answered or a second has passed.

    Args:
        bus: where they are.
        names: whom to ask.
        wait: called all the time meanwhile; takes some milliseconds.
    """
    questions = [bus.ask(ABOUT.key(bus.team, name), _TIMEOUT) for name in names]
    _wait_for(_TIMEOUT + _GRACE, wait, lambda: all(question.over for question in questions))
    told: Told = {}
    for question in questions:
        for arrived_ns, key, payload in question.take():
            name = key.split("/")[1]
            answer = MemberAnswer(read_about(name, payload), question.asked_ns, arrived_ns)
            told.setdefault(name, []).append(answer)
    return told


def view_of(bus: Bus, config: Config, told: Told, fallback: About | None = None) -> TeamView:
    """What a process sees of its team: who is on the bus, and what they have said.

    Args:
        bus: its own.
        config: the one it has.
        told: what `ask` has given.
        fallback: with what all are compared where the process that drives time says nothing.
    """
    linked = bus.linked or bus.name in LEADS  # to whom all others link
    here, doubled, names = bus.members_at(HERE), bus.duplicates(HERE), members(config)
    view = TeamView(linked, here, doubled, names, told)
    leader = view.about(lead(config)) or fallback
    if leader is None:
        return view
    planner = first_predicting(config)
    plans = view.about(planner)
    norm = TeamNorm(leader, plans.predictor if plans else "", planner)
    return TeamView(linked, here, doubled, names, told, norm)


def check_oneself(bus: Bus, config: Config, about: About, say: Callable[[str], None]) -> None:
    """Leave a team whose processes have something else in common.

    Whoever differs leaves by itself, so that the others can go on waiting for the right one.

    Raises:
        BusError: this process differs from the others; the message names in what.
    """
    leader = lead(config)
    others = {leader, first_predicting(config)} - {bus.name, ""}
    norm = view_of(bus, config, ask(bus, sorted(others))).norm
    if norm is None:
        if bus.name != leader:
            say(f"{leader} does not say what it is: frozen, or an earlier version of quadriga?")
        return
    found = disagreements(about, norm)
    refuse(bus.name, bus.team, found)
    if any(item.of == CODE for item in found):
        say(f"{leader} has the same version of quadriga, but other source files")


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
    others, told = sorted({*names} - {bus.name}), ask(bus, wait=wait)
    foreign, deadline = foreign_members(config), monotonic() + _PATIENCE
    while (silent := [n for n in others if n not in {*told, *foreign}]) and monotonic() < deadline:
        _wait_for(_BETWEEN, wait)
        told |= ask(bus, silent, wait)
    view = view_of(bus, config, told, describe_process(config, bus.name))
    for name in others:
        if name in foreign and name not in told:
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


def _wait_for(seconds: float, wait: Pause, over: Callable[[], bool] = lambda: False) -> None:
    deadline = monotonic() + seconds
    while not over() and monotonic() < deadline:
        wait()


def read_about(name: str, payload: bytes) -> About | None:
    """What a process says of itself; None if it cannot be read, or is not about this process."""
    try:
        about = decode(payload, About)
    except MessageError:
        return None
    texts = (about.host, about.version, about.code, about.predictor, *about.libraries)
    plain = all(text.isprintable() for text in (*texts, *about.config, *about.sees))
    return about if plain and about.name == name and about.stage in STAGES else None
