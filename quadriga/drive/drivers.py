"""SHELL of driving from a program: by the keys of a terminal, or by a gamepad of this machine."""

from __future__ import annotations

import os
import select
from collections.abc import Callable
from pathlib import Path
from typing import Final

from quadriga.drive import gamepad as pads
from quadriga.drive.client import ControlLink
from quadriga.drive.driver_words import DRIVE, ESTOP, NEWS, RELEASE, TAKE
from quadriga.drive.gamepad import EVENT_BYTES, Gamepad
from quadriga.drive.keys import HELP, KEYS, Keys, press
from quadriga.drive.wish import NAMES, Wish
from quadriga.keyboard import Keyboard
from quadriga.shared.errors import ConfigError, system_reason
from quadriga.shared.printable import printable_line

PERIOD: Final = 0.05  # s, between two of what is asked for
_TOLD_EVERY: Final = 4  # of them
_LONGEST_READ: Final = 64 * EVENT_BYTES

Say = Callable[[str], None]


def drive_by_keys(link: ControlLink, rest: Wish, stopped: Callable[[], bool], say: Say) -> None:
    """Drive until Ctrl-D or a signal; the team then stands.

    Args:
        link: to the operator.
        rest: to stand with.
        stopped: asked often whether to leave.
        say: shows a line to the driver.

    Raises:
        ConfigError: there is no terminal.
        BusError: the operator is gone, or frozen.
    """
    keys, teller = Keys(rest), _Teller(link, say)
    with Keyboard(KEYS) as keyboard:
        if not keyboard.listens:
            raise ConfigError("--keyboard", "no terminal", "to be run in one", "is it piped?")
        say(HELP)
        while not (stopped() or keys.over):
            keys = press(keys, keyboard.get(PERIOD), rest)
            if keys.word:
                _say_word(link, keys.word, say)
            _ask(link, keys.wish, held=keys.held)
            teller.tell()
    link.say(RELEASE)


def drive_by_gamepad(
    link: ControlLink, device: Path, rest: Wish, stopped: Callable[[], bool], say: Say
) -> None:
    """Drive until a signal, or until the gamepad is gone; the team then stands.

    Args:
        link: to the operator.
        device: such as /dev/input/js0.
        rest: to stand with.
        stopped: asked often whether to leave.
        say: shows a line to the driver.

    Raises:
        ConfigError: there is no such gamepad.
        BusError: the operator is gone, or frozen.
    """
    try:
        opened = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
    except OSError as error:
        cause = "is it plugged in, and may you read it (group input)?"
        raise ConfigError(str(device), system_reason(error), "a gamepad", cause) from None
    pad, teller = Gamepad(), _Teller(link, say)
    say("start: take the controls · hold the right shoulder, sticks drive · B: STOP")
    try:
        while not stopped():
            select.select([opened], [], [], PERIOD)
            pad = _read(link, opened, pad, say)
            held = pads.HOLD_BUTTON in pad.pressed
            _ask(link, pads.wish_of(pad, rest) if held else rest, held=held)
            teller.tell()
    except OSError as error:
        say(f"{device}: {system_reason(error)}")
    finally:
        os.close(opened)
    link.say(RELEASE)


def _read(link: ControlLink, opened: int, pad: Gamepad, say: Say) -> Gamepad:
    """The gamepad after all that has come; what its buttons say is said at once."""
    try:
        received = os.read(opened, _LONGEST_READ)
    except BlockingIOError:
        return pad
    for start in range(0, len(received) - EVENT_BYTES + 1, EVENT_BYTES):
        pad, button = pads.take(pad, received[start : start + EVENT_BYTES])
        if button == pads.STOP_BUTTON:
            _say_word(link, ESTOP, say)
        elif button == pads.TAKE_BUTTON:
            link.say(TAKE)
    return pad


def _say_word(link: ControlLink, word: str, say: Say) -> None:
    if word != ESTOP:
        link.say(word)
        return
    say(describe_stop(link.stop("driver")))


def _ask(link: ControlLink, wish: Wish, *, held: bool) -> None:
    link.say(DRIVE, held=held, **{name: getattr(wish, name) for name in NAMES})


def describe_stop(answer: dict[str, object]) -> str:
    """What came of an emergency stop, from the operator's answer."""
    missing = answer.get("missing")
    if missing:
        names = ", ".join(map(str, missing)) if isinstance(missing, list) else str(missing)
        return printable_line(f"not stopped: {names} after {answer.get('ms')} ms; cut the power")
    return f"stopped within {answer.get('ms')} ms: every joint is damped, until `quadriga reset`"


class _Teller:
    """Shows who drives and what the robots do, whenever that changes."""

    def __init__(self, link: ControlLink, say: Say) -> None:
        self._link, self._say = link, say
        self._count, self._shown = 0, ""

    def tell(self) -> None:
        self._count += 1
        if self._count % _TOLD_EVERY:
            return
        news = self._link.ask(NEWS)
        mine = news.get("driver") == news.get("you")
        who = "you have the controls" if mine else news.get("driver") or news.get("stands")
        robots = news.get("robots", {})
        modes = [
            f"{name} {robot.get('mode')} {robot.get('reason')}".rstrip()
            for name, robot in robots.items()
        ]
        shown = printable_line(f"{who}: {'; '.join(modes)}")
        if shown != self._shown:
            self._shown = shown
            self._say(shown)
