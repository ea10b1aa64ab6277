"""Falls, faults and stops, each with the second before it, robot by robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from quadriga.charts.thinning import find_spells
from quadriga.report.conditions import Condition, assess_robot
from quadriga.report.run import ReportedRun
from quadriga.report.samples import Samples, find_slip
from quadriga.report.timeline import TimelineEntry
from quadriga.report.window import (
    BEFORE_MS,
    SLIP,
    TILT,
    TOGETHER_MS,
    TORQUE,
    cut_window,
    find_lost_stance,
    passive_since,
)
from quadriga.shared.codes import FALL
from quadriga.shared.robots.conventions import Leg
from quadriga.shared.topics import SAMPLE_MS

_SIGNS: Final = ("push", "plan", "counted", "gap", "mode")  # kinds of entries that are signs


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
        entries: what showed then.
        signs: what was out of the ordinary before, by time.
        conditions: of each robot.
    """

    tick: int
    entries: tuple[TimelineEntry, ...]
    signs: tuple[Sign, ...]
    conditions: tuple[Condition, ...]

    @property
    def robots(self) -> tuple[str, ...]:
        """Whom it concerns, those that fell first."""
        ordered = sorted(self.entries, key=lambda entry: entry.kind != FALL)
        return tuple(dict.fromkeys(entry.robot for entry in ordered if entry.robot))


def find_troubles(run: ReportedRun) -> list[Trouble]:
    """All troubles of a run, those that come together as one."""
    groups: list[list[TimelineEntry]] = []
    for entry in run.timeline:
        if entry.trouble:
            if groups and entry.tick - groups[-1][0].tick <= TOGETHER_MS:
                groups[-1].append(entry)
            else:
                groups.append([entry])
    return [_build_trouble(run, group) for group in groups]


def _build_trouble(run: ReportedRun, entries: Sequence[TimelineEntry]) -> Trouble:
    tick = entries[0].tick
    signs = [
        Sign(entry.tick, entry.robot, _describe(entry, tick))
        for entry in run.timeline
        if entry.kind in _SIGNS
        and tick - BEFORE_MS <= entry.stop
        and entry.tick <= tick
        and passive_since(run, entry.robot, tick) is None
    ]
    for robot in run.traces.robots:
        if passive_since(run, robot, tick) is None:
            signs += _find_signs(robot, cut_window(run.samples[robot], tick))
    signs += _find_planless(run, tick)
    signs.sort(key=lambda sign: sign.tick)
    conditions = tuple(assess_robot(run, index, tick) for index in range(len(run.traces.robots)))
    return Trouble(tick, tuple(entries), tuple(signs), conditions)


def _describe(entry: TimelineEntry, tick: int) -> str:
    """An entry in words, and how long it lasted if it was not over at `tick`."""
    text = f"{entry.kind}: {entry.text}" if entry.text else entry.kind
    return text + (f", until {entry.stop / 1000:.2f} s" if entry.stop > tick else "")


def _find_signs(robot: str, window: Samples) -> Iterator[Sign]:
    """The first of each kind, with all of that kind in the second summed up."""

    def first(spells: Sequence[tuple[int, int]], text: str) -> Iterator[Sign]:
        if spells:
            ms = SAMPLE_MS * sum(b - a for a, b in spells)
            yield Sign(int(window.tick[spells[0][0]]), robot, f"{text}, {ms} ms in all")

    yield from first(find_spells(window.tilt > TILT), f"tilts more than {TILT:g} rad")
    for leg, speed in zip(Leg, find_slip(window).T, strict=True):
        fastest = f"{leg.name} slips at up to {speed.max(initial=0.0):.2f} m/s"
        yield from first(find_spells(speed > SLIP), fastest)
        yield from first(find_lost_stance(window, leg), f"{leg.name} finds no ground in its stance")
    yield from first(find_spells(window.torque >= TORQUE), "a joint at its torque limit")


def _find_planless(run: ReportedRun, tick: int) -> Iterator[Sign]:
    """Robots that made no plan in the second up to `tick`, although others did."""
    begin = tick - BEFORE_MS
    made = {
        robot: any(begin < plan.tick <= tick for plan in plans)
        for robot, plans in run.traces.plans.items()
    }
    for robot, planned in made.items():
        if any(made.values()) and not planned and passive_since(run, robot, tick) is None:
            yield Sign(max(begin, run.begin), robot, "makes no plan in this second")
