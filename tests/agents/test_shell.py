"""The agent's shell with a bus that is none: what it does about a clock that has been set."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, cast

import pytest

from quadriga.agents import shell
from quadriga.agents.agent import Agent
from quadriga.agents.inbox.inbox import Inbox
from quadriga.shared.bus.standstill import Standstill
from quadriga.shared.bus.zenoh_bus import Bus, Packet
from quadriga.shared.config.load import load
from quadriga.shared.errors import BusError
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import Command
from tests.a1 import standing

SECOND = 1000  # packets


class Line:
    """Brings one state a millisecond, none for a tenth of a second at None; keeps the time."""

    def __init__(self, ticks: Iterable[int | None]) -> None:
        self._ticks = iter(ticks)
        self.name, self.now, self.ended = "r1", 0.0, False
        self.standstill = Standstill()
        self.answered: list[int] = []

    def get(self, timeout: float) -> Packet | None:
        tick = next(self._ticks, -1)
        self.ended = tick == -1
        self.now += timeout if tick is None else 1e-3
        return None if tick is None or self.ended else ("team/r1/state", encode(standing(tick)))

    def drain(self) -> list[Packet]:
        return []

    def members_at(self, stage: str) -> frozenset[str]:
        return frozenset({"sim"})

    def publisher(self, key: str, **_: bool) -> Callable[[bytes], None]:
        return self._note if key.endswith("command") else lambda payload: None

    def _note(self, payload: bytes) -> None:
        self.answered.append(decode(payload, Command).tick)


def walk(monkeypatch: pytest.MonkeyPatch, ticks: Iterable[int | None]) -> Line:
    given: dict[str, Any] = {"team.robots": 1, "planner.kind": "none", "world.mode": "realtime"}
    line, config = Line(ticks), load(None, given)
    monkeypatch.setattr(shell, "monotonic", lambda: line.now)
    arrivals, agent = Inbox(config, "r1", ()), Agent(config, "r1", None)
    answering = shell.AgentShell(config, agent, arrivals, cast("Bus", line))
    answering.walk(lambda: line.ended)
    return line


@pytest.mark.parametrize(
    ("first", "then"),
    [([0, 4000, 4001], 0), ([1 << 41, (1 << 41) + 1], 0), ([0], 10**6)],
    ids=["restarted", "forged", "set ahead"],
)
def test_a_clock_that_has_been_set_ends_the_process_with_a_word(
    monkeypatch: pytest.MonkeyPatch, first: list[int], then: int
) -> None:
    with pytest.raises(BusError, match=r"team/r1/state: got 30\d\d states within 3 s whose ticks"):
        walk(monkeypatch, [*first, *range(then, then + 4 * SECOND)])


def test_states_out_of_order_end_nothing_while_others_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mixed = [tick for now in range(2 * SECOND) for tick in (now, max(0, now - 7), 1 << 41)]
    line = walk(monkeypatch, mixed)
    assert line.answered == [*range(2 * SECOND)]


def test_one_state_again_is_no_reason_however_long_the_world_stands_still(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = walk(monkeypatch, [0, 1, 1, *[None] * 50, 2])
    assert line.answered == [0, 1, 2]


@pytest.mark.parametrize("forged", [4990, 101, 1 << 41])
def test_a_forged_state_far_ahead_stops_no_answer(
    monkeypatch: pytest.MonkeyPatch, forged: int
) -> None:
    line = walk(monkeypatch, [0, 1, 2, 2 + forged, *range(3, 50)])
    assert line.answered == [*range(50)]
    line = walk(monkeypatch, [forged, *range(50)])
    assert line.answered == [*range(50)], "nor as the first of all"
