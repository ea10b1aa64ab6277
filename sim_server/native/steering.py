"""Orders of an operator, carried out at their time on the simulated robots."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping, Sequence
from itertools import count
from typing import Final, Protocol

from quadriga.shared.errors import QuadrigaError
from quadriga.shared.runtime.clock import monotonic
from quadriga.sim_server.native.board import Board
from quadriga.sim_server.native.hanger import Hanger
from quadriga.sim_server.native.orders import (
    HELP,
    Charge,
    ClearFaults,
    Disturb,
    Hang,
    Intrude,
    MarkTime,
    Press,
    Protect,
    RemoteOff,
    RobotOrder,
    Switch,
    parse_order,
)

_LOOK_MS: Final = 10  # between two looks at what has come in


class Lines(Protocol):
    """Where orders come from."""

    def lines(self) -> list[str]:
        """Those that have come since the last call."""
        ...


class Steering:
    """See this module.

    Args:
        boards: of the robots, by name.
        hanger: of their world.
        source: of lines while they run.
        orders: from the start.
        say: tells the operator.
    """

    def __init__(
        self,
        boards: Mapping[str, Board],
        hanger: Hanger,
        source: Lines,
        orders: Sequence[RobotOrder],
        say: Callable[[str], None],
    ) -> None:
        self._boards, self._hanger, self._source, self._say = boards, hanger, source, say
        self._numbers = count()  # orders of one tick keep their order
        self._due: list[tuple[int, int, RobotOrder]] = []
        for order in orders:
            self._await(order, 0)

    def turn(self, now: int) -> None:
        """Carry out what is due at a tick, ms."""
        if now % _LOOK_MS == 0:
            for line in self._source.lines():
                self._read(line, now)
        while self._due and self._due[0][0] <= now:
            order = heapq.heappop(self._due)[2]
            try:
                self._carry_out(order, now)
            except QuadrigaError as error:
                self._say(f"{now} ms: {error}")

    def _read(self, line: str, now: int) -> None:
        if line == "help":
            self._say(HELP)
            return
        try:
            order = parse_order(line, tuple(self._boards))
        except QuadrigaError as error:
            self._say(f"{now} ms: {error}")
            return
        self._await(order, now)
        if order.at is not None and order.at > now:
            self._say(f"{now} ms: noted for {order.at} ms: {order.text}")

    def _await(self, order: RobotOrder, now: int) -> None:
        at = now if order.at is None else order.at
        heapq.heappush(self._due, (at, next(self._numbers), order))

    def _carry_out(self, order: RobotOrder, now: int) -> None:
        for name in order.robots:
            self._act(name, order, now)
        # Others know when by their own clocks.
        clock = f" (clock {monotonic():.4f} s)" if isinstance(order.act, MarkTime) else ""
        self._say(f"{now} ms: order {order.text}{clock}")

    def _act(self, name: str, order: RobotOrder, now: int) -> None:
        board = self._boards[name]
        match order.act:
            case Disturb(fault, value, ways):
                board.disturb(fault, value, ways)
            case Press(buttons, ms):
                board.condition.press(buttons, None if ms is None else now + ms)
            case RemoteOff():
                board.condition.switch_remote_off()
            case Charge(percent):
                board.condition.set_charge(percent, now)
            case Protect(joint):
                board.condition.protect(joint)
            case Switch(on):
                board.switch(on=on)
            case Intrude(there):
                board.intrude(there=there)
            case Hang(up):
                self._hanger.pull_up(name) if up else self._hanger.let_down(name)
            case ClearFaults():
                board.clear()
            case MarkTime():
                pass
