"""Faults of sensors and motors: the grammar of `world.faults`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from quadriga.shared.errors import ConfigError, did_you_mean

KEY: Final = "world.faults"
_GRAMMAR: Final = "'robot/component kind start[s] [duration[s]]', commas between faults"
_LATEST: Final = 3600.0  # s
SPAN_MS: Final = 50  # of what is slow, delayed or intermittent
AHEAD_MS: Final = SPAN_MS + 10  # from a word to the fault that it asks for

OFF: Final = "off"
STUCK: Final = "stuck"
GARBAGE: Final = "garbage"
WRONG: Final = "wrong"
SLOW: Final = "slow"
DELAYED: Final = "delayed"
INTERMITTENT: Final = "intermittent"
# By name, what a faulty component does. The words are those of PX4's failure injection.
KINDS: Final = {
    OFF: "zero; a motor gives no torque",
    STUCK: "the last sound value",
    GARBAGE: "chance, within the component's range, anew every millisecond",
    WRONG: "rates, forces and torques with the opposite sign, angles 0.2 rad off",
    SLOW: "a new value every 50 ms only",
    DELAYED: "50 ms late",
    INTERMITTENT: "off for a random half of all spans of 50 ms",
}


@dataclass(frozen=True, slots=True)
class ComponentFault:
    """What is wrong with one component of one robot, in ticks `start` to `stop` − 1.

    Attributes:
        robot: its name.
        component: a name of `components.COMPONENTS`.
        kind: a name of `KINDS`.
        start: tick, ms.
        stop: tick, ms; None: it never ends.
    """

    robot: str
    component: str
    kind: str
    start: int
    stop: int | None = None

    def holds(self, tick: int) -> bool:
        """Whether the component is faulty at this tick."""
        return self.start <= tick and (self.stop is None or tick < self.stop)

    @property
    def detail(self) -> str:
        """Detail of the event that announces its beginning."""
        return f"{self.component} {self.kind}"


def parse_faults(
    text: str, robots: tuple[str, ...], components: tuple[str, ...]
) -> tuple[ComponentFault, ...]:
    """The faults that a text describes, in the order written; empty text means none.

    Args:
        text: of the grammar above.
        robots: names of the team's robots.
        components: names of what can be faulty.

    Raises:
        ConfigError: the text does not follow the grammar, or names what there is not.
    """
    if not text:
        return ()
    found = tuple(_parse(part.strip(), robots, components) for part in text.split(","))
    for fault in found:
        if found.count(fault) > 1:
            raise ConfigError(KEY, f"{fault.robot}/{fault.detail} twice", "each fault once")
    return found


def with_time(text: str, tick: int) -> str:
    """A fault as `world.faults` has it, of one without its time: it begins some ms after a tick.

    What a faulty component says may depend on what it has said in the `AHEAD_MS` before.

    Raises:
        ConfigError: there are too few or too many words.
    """
    words = text.split()
    if len(words) not in (2, 3):
        raise ConfigError("fault", repr(text), "'robot/component kind [duration[s]]'")
    return " ".join([*words[:2], f"{1e-3 * (tick + AHEAD_MS):.3f}", *words[2:]])


def _parse(part: str, robots: tuple[str, ...], components: tuple[str, ...]) -> ComponentFault:
    words = part.split()
    if len(words) not in (3, 4) or "/" not in words[0]:
        raise ConfigError(KEY, repr(part), _GRAMMAR)
    (robot, _, component), kind = words[0].partition("/"), words[1]
    _check_word("robot", robot, robots)
    _check_word("component", component, components)
    _check_word("kind", kind, tuple(KINDS))
    start = _seconds("start", words[2], part, 0.0)
    duration = _seconds("duration", words[3], part, 1e-3) if len(words) == 4 else None
    first = round(1000 * start)
    return ComponentFault(
        robot=robot,
        component=component,
        kind=kind,
        start=first,
        stop=None if duration is None else first + round(1000 * duration),
    )


def _check_word(what: str, word: str, known: tuple[str, ...]) -> None:
    if word not in known:
        hint = did_you_mean(word, known)
        raise ConfigError(KEY, f"{what} {word!r}", f"one of {', '.join(known)}", hint)


def _seconds(what: str, word: str, part: str, least: float) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not least <= value <= _LATEST:  # this way round, it refuses what is not a number, too
        raise ConfigError(KEY, f"{what} {word!r} in {part!r}", f"{least:g} … {_LATEST:g} s")
    return value
