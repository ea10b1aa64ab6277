"""What processes might say of themselves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from quadriga.shared.about import READY, About
from quadriga.shared.bus.diagnostics import MemberAnswer, TeamView

NAMES: Final = frozenset({"sim", "r1", "r2"})
SIM: Final = About(
    tick=0,
    stamp_ns=0,
    name="sim",
    host="lab",
    pid=7,
    version="0.1.0",
    code="0123456789abcdef",
    config=('team.name="team"', "world.seed=5", 'world.mode="lockstep"'),
    messages=("state 5c", "command 3f"),
    predictor="",
    stage=READY,
    sees=("r1", "r2"),
    wall_ns=10**18,
    start_ns=0,
)


def about(name: str, **changes: Any) -> About:
    """What a process says, which agrees with `SIM` but for these fields."""
    given = {"name": name, "sees": tuple(sorted(NAMES - {name})), **changes}
    return replace(SIM, **given)


def answer(said: About | None, took_ns: int = 10**6) -> MemberAnswer:
    """An answer for which the asker waited so long, and whose clock is the asker's."""
    return MemberAnswer(said, 10**18 - took_ns // 2, 10**18 + took_ns // 2)


def view(*said: About, **changes: Any) -> TeamView:
    """What is seen of a team in which these answer, and all are here but for `changes`."""
    answers: dict[str, list[MemberAnswer]] = {}
    for item in said:
        answers.setdefault(item.name, []).append(answer(item))
    return replace(TeamView(True, NAMES, frozenset(), NAMES, answers, SIM), **changes)
