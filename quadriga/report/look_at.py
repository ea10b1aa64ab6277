"""What to look at: for each fall or fault the second before it, robot by robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.report.account import Account, build_account
from quadriga.report.moments import FALL, Moment
from quadriga.report.path import spells
from quadriga.report.run import Run
from quadriga.report.samples import Samples
from quadriga.report.second import (
    BEFORE_MS,
    SLIP,
    TILT,
    TOGETHER_MS,
    TORQUE,
    airborne,
    down_since,
    window_before,
)
from quadriga.shared.robot.a1 import Leg
from quadriga.shared.wire.topics import SAMPLE_MS

_TELLING: Final = ("push", "plan", "counted", "gap", "mode")  # kinds of moments that are signs


@dataclass(frozen=True, slots=True)
class Sign:
    """Something out of the ordinary: when it began, of whom, what."""

    tick: int
    robot: str
    text: str


@dataclass(frozen=True, slots=True)
class Trouble:
    """A fall or fault, and the second before it.

    Attributes:
        tick: when it showed, ms.
        troubles: what showed then.
        signs: what was out of the ordinary before, by time.
        accounts: of each robot.
    """

    tick: int
    troubles: tuple[Moment, ...]
    signs: tuple[Sign, ...]
    accounts: tuple[Account, ...]

    @property
    def robots(self) -> tuple[str, ...]:
        """Whom it concerns, those that fell first."""
        ordered = sorted(self.troubles, key=lambda moment: moment.kind != FALL)
        return tuple(dict.fromkeys(moment.robot for moment in ordered if moment.robot))


def episodes(run: Run) -> list[Trouble]:
    """All troubles of a run, those that come together as one."""
    groups: list[list[Moment]] = []
    for moment in run.moments:
        if moment.trouble:
            if groups and moment.tick - groups[-1][0].tick <= TOGETHER_MS:
                groups[-1].append(moment)
            else:
                groups.append([moment])
    return [_episode(run, group) for group in groups]


def _episode(run: Run, troubles: Sequence[Moment]) -> Trouble:
    tick = troubles[0].tick
    signs = [
        Sign(m.tick, m.robot, _told(m, tick))
        for m in run.moments
        if m.kind in _TELLING
        and tick - BEFORE_MS <= m.stop
        and m.tick <= tick
        and down_since(run, m.robot, tick) is None
    ]
    for robot in run.traces.robots:
        if down_since(run, robot, tick) is None:
            signs += _signs(robot, window_before(run.samples[robot], tick))
    signs += _planless(run, tick)
    signs.sort(key=lambda sign: sign.tick)
    accounts = tuple(build_account(run, index, tick) for index in range(len(run.traces.robots)))
    return Trouble(tick, tuple(troubles), tuple(signs), accounts)


def _told(moment: Moment, tick: int) -> str:
    """A moment in words, and how long it lasted if it was not over at `tick`."""
    text = f"{moment.kind}: {moment.text}" if moment.text else moment.kind
    return text + (f", until {moment.stop / 1000:.2f} s" if moment.stop > tick else "")


def _signs(robot: str, window: Samples) -> Iterator[Sign]:
    """The first of each kind, with all of that kind in the second summed up."""

    def first(found: Sequence[tuple[int, int]], text: str) -> Iterator[Sign]:
        if found:
            ms = SAMPLE_MS * sum(b - a for a, b in found)
            yield Sign(int(window.tick[found[0][0]]), robot, f"{text}, {ms} ms in all")

    yield from first(spells(window.tilt > TILT), f"tilts more than {TILT:g} rad")
    for leg in Leg:
        standing = window.stance[:, leg] & window.contact[:, leg]
        speed = np.where(standing, np.nan_to_num(window.foot_speed[:, leg]), 0.0)
        fastest = f"{leg.name} slips at up to {speed.max(initial=0.0):.2f} m/s"
        yield from first(spells(speed > SLIP), fastest)
        yield from first(airborne(window, leg), f"{leg.name} finds no ground in its stance")
    yield from first(spells(window.torque >= TORQUE), "a joint at its torque limit")


def _planless(run: Run, tick: int) -> Iterator[Sign]:
    """Robots that made no plan in the second up to `tick`, although others did."""
    begin = tick - BEFORE_MS
    made = {
        robot: any(begin < plan.tick <= tick for plan in plans)
        for robot, plans in run.traces.plans.items()
    }
    for robot, planned in made.items():
        if any(made.values()) and not planned and down_since(run, robot, tick) is None:
            yield Sign(max(begin, run.begin), robot, "makes no plan in this second")
