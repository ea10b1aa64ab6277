"""A fault of the table at a robot and a moment that somebody has chosen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.faults.component_faults import given_component_fault
from quadriga.faults.fault import REALTIME_ROBOTS, Draw, Lasting, Stage, TeamFault
from quadriga.faults.link_faults import LINK_WORDS, LINKS
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, did_you_mean
from quadriga.shared.robots.conventions import robot_names
from quadriga.sim_server.world.faults import KINDS, build_components

GRAMMAR: Final = "NAME or [ROBOT/]PART KIND, with --at S [--for S]"
PARTS: Final = ("agent", "link", "radio", "clock")  # of a robot
_EARLIEST, _LATEST = 0.001, 3600.0  # s


def find_given_fault(text: str, config: Config, table: Mapping[str, TeamFault]) -> TeamFault:
    """The fault that a text describes: one of the table, or of a component as in `world.faults`.

    Args:
        text: `name start [duration]`, `process kind start [duration]` or
            `robot/part kind start [duration]`; times in s of world time.
        config: of the team.
        table: faults by name.

    Raises:
        ConfigError: there is no such fault, robot, part or kind.
    """
    words = text.split()
    robot, of_robot, part = words[0].rpartition("/")
    if of_robot and part not in PARTS:
        _check_part(part, config)
        return given_component_fault(text, config)
    named = words[0] in table
    name = words[0] if named else _name_of(part, *words[1:2])
    times = words[1:] if named else words[2:]
    if of_robot:
        _check_robot(robot, config)
    _check_kind(name, part, words, table)
    if len(times) not in (1, 2):
        raise ConfigError("fault", repr(text), GRAMMAR)
    start, *duration = [_seconds(word, text) for word in times]
    fault = table[name]
    found = replace(fault, name=text, base=name, given=(robot, round(1000 * start)))
    return _lasting(found, fault, duration[0]) if duration else found


def _name_of(part: str, kind: str = "") -> str:
    """The name that the table has for a kind of fault of a part; of links all words will do.

    Raises:
        ConfigError: a word for sensors and motors that means nothing for a link.
    """
    if part in LINKS and kind in LINK_WORDS:
        return f"{part}-{LINK_WORDS[kind]}"
    if part in LINKS and kind in KINDS:
        cause = "a link carries packets: it has no value that could be stuck or wrong"
        raise ConfigError(
            "fault", f"{kind!r} of a {part}", f"one of {', '.join(LINK_WORDS)}", cause
        )
    return f"{part}-{kind}" if kind else part


def _check_part(part: str, config: Config) -> None:
    known = (*PARTS, *build_components(config.robot))
    if part not in known:
        hint = did_you_mean(part, known)
        raise ConfigError("fault", f"component {part!r}", f"one of {', '.join(known)}", hint)


def _check_robot(robot: str, config: Config) -> None:
    """See that a robot walks: in real time there are few."""
    known = robot_names(min(config.team.robots, REALTIME_ROBOTS))
    if robot not in known:
        cause = f"in real time {REALTIME_ROBOTS} robots walk at most"
        raise ConfigError("fault", f"robot {robot!r}", f"one of {', '.join(known)}", cause)


def _check_kind(name: str, part: str, words: list[str], table: Mapping[str, TeamFault]) -> None:
    """See that the table has what is asked for."""
    if name in table:
        return
    kinds = [n.partition("-")[2] for n in table if n.partition("-")[0] == part]
    kinds = [kind for kind in kinds if kind]
    if part in LINKS:
        kinds = [*LINK_WORDS, *(kind for kind in kinds if kind not in LINK_WORDS)]
    if not kinds:
        hint = did_you_mean(name, table) or "`quadriga fault --list` lists them"
        raise ConfigError("fault", repr(" ".join(words[:2])), GRAMMAR, hint)
    got = words[1] if len(words) > 1 else "none"
    hint = did_you_mean(got, kinds)
    raise ConfigError("fault", f"{got!r} of {words[0]}", f"one of {', '.join(kinds)}", hint)


def _seconds(word: str, text: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not _EARLIEST <= value <= _LATEST:  # this way round, it refuses what is not a number, too
        raise ConfigError(
            "fault", f"time {word!r} in {text!r}", f"{_EARLIEST:g} … {_LATEST:g} s of world time"
        )
    return value


def _lasting(found: TeamFault, fault: TeamFault, seconds: float) -> TeamFault:
    """The fault for so many seconds, in a walk that is as much longer."""
    if fault.lasting is None:
        cause = "it lasts as long as its name says"
        raise ConfigError("--for", f"{seconds:g} with {fault.name}", "--at alone", cause)
    lasting: Lasting = fault.lasting

    @contextmanager
    def stage(config: Config, draw: Draw, folder: Path) -> Iterator[Stage]:
        world = replace(config.world, duration=config.world.duration + seconds)
        with lasting(seconds)(replace(config, world=world), draw, folder) as made:
            yield made._replace(detail=f"for {seconds:g} s")

    return replace(found, stage=stage)
