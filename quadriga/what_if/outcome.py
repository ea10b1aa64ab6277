"""What came of the recorded walk and of its branch, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from quadriga.recordings.truth import TruthTrace, build_truth_trace, distance
from quadriga.shared.codes import FALL
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Event, Truth
from quadriga.shared.robots.conventions import robot_names
from quadriga.tables import NOTHING, Table


@dataclass(frozen=True, slots=True)
class WalkCourse:
    """How a walk went.

    Attributes:
        truth: of the whole walk.
        falls: robots that fell, each with the time, s.
    """

    truth: TruthTrace
    falls: tuple[tuple[str, float], ...]


def build_course(config: Config, truths: Sequence[Truth], events: Iterable[Event]) -> WalkCourse:
    """The course of a walk from its messages."""
    falls = tuple((event.robot, 1e-3 * event.tick) for event in events if event.code == FALL)
    return WalkCourse(build_truth_trace(truths, config), falls)


def build_what_if_table(
    config: Config, recorded: WalkCourse, branch: WalkCourse, moment: int, changed: str
) -> Table:
    """Falls, way and attitude of both walks; what has a time span counts from the moment on.

    Args:
        config: of the recorded walk.
        recorded: its course.
        branch: the branch's.
        moment: where the branch begins, ms.
        changed: what is different, in words.
    """
    pairs = zip(_rows(config, recorded, moment), _rows(config, branch, moment), strict=True)
    rows = tuple((name, before, after) for (name, before), (_, after) in pairs)
    title = f"From {1e-3 * moment:g} s on: {changed}"
    return Table(title, ("", "recorded", "what if"), rows)


def _rows(config: Config, course: WalkCourse, moment: int) -> Iterator[tuple[str, str]]:
    truth = course.truth
    falls = ", ".join(f"{robot} at {at:.2f} s" for robot, at in course.falls)
    yield "falls", falls or "none"
    yield "walked until [s]", f"{1e-3 * truth.tick[-1]:.2f}" if len(truth.tick) else NOTHING
    way = distance(truth, 2 * config.gait.stance_ms)
    yield "way [m]", NOTHING if way is None else f"{way:.2f}"
    after = truth.tick >= moment
    for index, robot in enumerate(robot_names(config.team.robots)):
        if not after.any():
            yield from ((f"{robot}, {what}", NOTHING) for what in ("tilt", "trunk"))
            continue
        tilt, height = truth.tilt[after, index], truth.y[after, index, 0]
        yield f"{robot}, tilt at most [rad]", f"{np.max(tilt):.3f}"
        yield f"{robot}, trunk at least [m]", f"{np.min(height):.3f}"
