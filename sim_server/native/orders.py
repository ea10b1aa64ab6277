"""What an operator may ask of the simulated robots while they run: one line, one order.

    [SECONDS] ROBOT|all WORD …

Pure: from a line of text to what it asks for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from quadriga.shared.errors import ConfigError, did_you_mean
from quadriga.shared.robot.conventions import JOINT_NAMES
from quadriga.shared.unitree.remote import parse_buttons
from quadriga.sim_server.native.board import COMMANDS, REPORTS

PRESS_MS: Final = 500  # for which buttons are pressed
_SHARES: Final = ("loss", "duplicate", "reorder", "garbage")
_TIMES: Final = ("delay", "jitter")
_LONGEST: Final = 1000.0  # ms
_LATEST: Final = 86_400.0  # s
_MARK: Final = "mark"
_ALL: Final = "all"

HELP: Final = """\
[SECONDS] ROBOT|all WORD …, SECONDS after the start if given; faults last until another order
  loss|duplicate|reorder|garbage SHARE [commands|reports]   share of packets, 0 … 1; both ways
  delay|jitter MS [commands|reports]                        ms; jitter: up to so much more
  remote BUTTONS [hold]    press L2+B for ½ s, or until remote release
  remote release|off|on    let go of all buttons; switch the remote control off, on
  battery PERCENT          charge
  protect JOINT            this motor switches itself off, such as FR_calf_joint
  off|on                   switch the robot off: no packets, its motors brake
  writer [off]             somebody else sends it damping commands
  hang|lower               pull it into the air, let it down
  clear                    end all faults, battery full again, robot on
mark TEXT                  say the time
help"""


@dataclass(frozen=True, slots=True)
class Disturb:
    """Set one of `LinkFaults`, on these ways."""

    fault: str
    value: float
    ways: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Press:
    """Press these buttons and no others, for so many ms; None: until told otherwise."""

    buttons: frozenset[str]
    ms: int | None


@dataclass(frozen=True, slots=True)
class RemoteOff:
    """Switch the remote control off."""


@dataclass(frozen=True, slots=True)
class Charge:
    """Give the battery a charge, %."""

    percent: float


@dataclass(frozen=True, slots=True)
class Protect:
    """Have a motor switch itself off; its index in `JOINT_NAMES`."""

    joint: int


@dataclass(frozen=True, slots=True)
class Switch:
    """Switch the robot on or off."""

    on: bool


@dataclass(frozen=True, slots=True)
class Intrude:
    """Have a second writer appear, or leave."""

    there: bool


@dataclass(frozen=True, slots=True)
class Hang:
    """Pull the robot up, or let it down."""

    up: bool


@dataclass(frozen=True, slots=True)
class ClearFaults:
    """End all faults."""


@dataclass(frozen=True, slots=True)
class MarkTime:
    """Say the time."""


Act = (
    Disturb
    | Press
    | RemoteOff
    | Charge
    | Protect
    | Switch
    | Intrude
    | Hang
    | ClearFaults
    | MarkTime
)


@dataclass(frozen=True, slots=True)
class RobotOrder:
    """What a line asks for.

    Attributes:
        robots: names of those it is for.
        act: what is done.
        at: tick, ms; None: at once.
        text: the line without its time.
    """

    robots: tuple[str, ...]
    act: Act
    at: int | None
    text: str


def parse_order(line: str, names: Sequence[str]) -> RobotOrder:
    """The order of a line.

    Args:
        line: of text.
        names: of the robots.

    Raises:
        ConfigError: it is none; the error says what was expected in its place.
    """
    words = line.split()
    at = None
    if words and (seconds := _number(words[0])) is not None:
        if not 0.0 <= seconds <= _LATEST:
            raise _refusal(f"{words[0]} s", f"0 … {_LATEST:g} s since the start")
        at, words = round(1000.0 * seconds), words[1:]
    text = " ".join(words)
    if words and words[0] == _MARK:
        return RobotOrder((), MarkTime(), at, text)
    if not words or words[0] not in (_ALL, *names):
        got = repr(words[0]) if words else "nothing"
        raise _refusal(got, f"{_ALL}, {', '.join(names)}, {_MARK} or help")
    robots = tuple(names) if words[0] == _ALL else (words[0],)
    if len(words) < 2 or words[1] not in _WORDS:
        got = repr(words[1]) if len(words) > 1 else f"{words[0]!r} alone"
        cause = did_you_mean(words[1], _WORDS) if len(words) > 1 else ""
        raise _refusal(got, f"{words[0]} and one of {', '.join(_WORDS)}", cause)
    return RobotOrder(robots, _WORDS[words[1]](words[1], words[2:]), at, text)


def _disturb(word: str, rest: list[str]) -> Act:
    high, what = (1.0, "a share of packets, 0 … 1") if word in _SHARES else (_LONGEST, "")
    what = what or f"0 … {_LONGEST:g} ms"
    ways: tuple[str, ...] = (COMMANDS, REPORTS)
    if len(rest) == 2 and rest[1] in ways:
        ways, rest = (rest[1],), rest[:1]
    value = _number(rest[0]) if len(rest) == 1 else None
    if value is None or not 0.0 <= value <= high:
        raise _refusal(
            _quoted(word, rest), f"{word}, {what}, then {COMMANDS}, {REPORTS} or nothing"
        )
    return Disturb(word, value, ways)


def _remote(word: str, rest: list[str]) -> Act:
    if rest in (["release"], ["on"]):
        return Press(frozenset(), None)
    if rest == ["off"]:
        return RemoteOff()
    if len(rest) == 1:
        return Press(parse_buttons(rest[0], "order"), PRESS_MS)
    if len(rest) == 2 and rest[1] == "hold":
        return Press(parse_buttons(rest[0], "order"), None)
    raise _refusal(
        _quoted(word, rest), "remote BUTTONS, remote BUTTONS hold, remote release|off|on"
    )


def _battery(word: str, rest: list[str]) -> Act:
    percent = _number(rest[0]) if len(rest) == 1 else None
    if percent is None or not 0.0 <= percent <= 100.0:
        raise _refusal(_quoted(word, rest), "battery and 0 … 100 %")
    return Charge(percent)


def _protect(word: str, rest: list[str]) -> Act:
    if len(rest) != 1 or rest[0] not in JOINT_NAMES:
        expected = f"protect and one of {', '.join(JOINT_NAMES)}"
        raise _refusal(_quoted(word, rest), expected)
    return Protect(JOINT_NAMES.index(rest[0]))


def _writer(word: str, rest: list[str]) -> Act:
    if rest not in ([], ["off"]):
        raise _refusal(_quoted(word, rest), "writer, or writer off")
    return Intrude(not rest)


def _alone(act: Act) -> Callable[[str, list[str]], Act]:
    """What parses a word that stands alone."""

    def parse(word: str, rest: list[str]) -> Act:
        if rest:
            raise _refusal(_quoted(word, rest), f"{word} alone")
        return act

    return parse


_WORDS: Final[Mapping[str, Callable[[str, list[str]], Act]]] = {
    **dict.fromkeys((*_SHARES, *_TIMES), _disturb),
    "remote": _remote,
    "battery": _battery,
    "protect": _protect,
    "off": _alone(Switch(False)),
    "on": _alone(Switch(True)),
    "writer": _writer,
    "hang": _alone(Hang(True)),
    "lower": _alone(Hang(False)),
    "clear": _alone(ClearFaults()),
}


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def _quoted(word: str, rest: list[str]) -> str:
    return repr(" ".join((word, *rest)))


def _refusal(got: str, expected: str, cause: str = "") -> ConfigError:
    return ConfigError("order", got, expected, cause)
