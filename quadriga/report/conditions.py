"""The condition of each robot in the second before a trouble, in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.agents.gait import nominal_forces, scheduled_stance, step_ms
from quadriga.agents.planner.solver import SOLVED
from quadriga.report.run import ReportedRun
from quadriga.report.samples import Samples, find_slip
from quadriga.report.window import (
    BEFORE_MS,
    SLIP,
    TILT,
    TORQUE,
    YOKE,
    cut_window,
    find_lost_stance,
    passive_since,
)
from quadriga.shared.messages import Plan
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import N_LEGS, Leg, yoke_pairs
from quadriga.shared.topics import REFERENCE, SAMPLE_MS

_AT_LIMIT: Final = 0.99  # share of a planned force's limit


@dataclass(frozen=True, slots=True)
class Condition:
    """A robot in the second before a trouble.

    Attributes:
        robot: its name.
        cells: for each of `COLUMNS` a text, and whether it is out of the ordinary; one cell alone
            for a robot that was passive before.
    """

    robot: str
    cells: tuple[tuple[str, bool], ...]


COLUMNS: Final = (
    "tilt at the end", "greatest tilt", "fastest slip", "stance without ground",
    "torque at most", "strongest yoke", "planned force at a limit", "plans", "oldest input",
)  # fmt: skip


def assess_robot(run: ReportedRun, index: int, tick: int) -> Condition:
    """The condition of the robot at `index` in the second up to `tick`."""
    robot = run.traces.robots[index]
    down = passive_since(run, robot, tick)
    if down is not None:
        return Condition(robot, ((f"down since {down / 1000:.2f} s", False),))
    window = cut_window(run.samples[robot], tick)
    cells = (
        *_assess_trunk(window),
        *_assess_feet(window),
        _find_strongest_yoke(run, index, tick),
        *_assess_planning(run, index, tick),
        _find_oldest_input(run, robot, tick),
    )
    return Condition(robot, cells)


def _assess_trunk(window: Samples) -> Iterator[tuple[str, bool]]:
    if not len(window.tick):
        yield from [("not recorded", False)] * 2
        return
    for tilt in (float(window.tilt[-1]), float(window.tilt.max())):
        yield f"{tilt:.2f} rad ({np.rad2deg(tilt):.0f}°)", tilt > TILT


def _assess_feet(window: Samples) -> Iterator[tuple[str, bool]]:
    if not len(window.tick):
        yield from [("not recorded", False)] * 3
        return
    slip = find_slip(window)
    leg = Leg(int(slip.max(axis=0).argmax())).name
    fastest = float(slip.max())
    unknown = not np.isfinite(window.foot_speed).any()
    yield ("unknown" if unknown else f"{fastest:.2f} m/s, {leg}"), fastest > SLIP
    lost = {Leg(k).name: sum(b - a for a, b in find_lost_stance(window, k)) for k in range(N_LEGS)}
    named = ", ".join(f"{name} {SAMPLE_MS * count} ms" for name, count in lost.items() if count)
    yield named or "none", bool(named)
    torque = float(window.torque.max())
    yield f"{100 * min(torque, 1.0):.0f} %", torque >= TORQUE


def _find_strongest_yoke(run: ReportedRun, index: int, tick: int) -> tuple[str, bool]:
    """The greatest force in a yoke of the robot, and whether it is more than its weight bears."""
    truth, team = run.traces.truth, run.traces.config.team
    pairs = yoke_pairs(team.robots, team.yokes)
    own = [k for k, pair in enumerate(pairs) if index in pair]
    kept = (truth.tick > tick - BEFORE_MS) & (truth.tick <= tick)
    if not own:
        return "no yoke", False
    if not kept.any() or truth.yoke_force.shape[1:] != (len(pairs),):
        return "not recorded", False
    forces = truth.yoke_force[kept][:, own]
    sample, yoke = np.unravel_index(np.abs(forces).argmax(), forces.shape)
    force = float(forces[sample, yoke])
    peer = run.traces.robots[sum(pairs[own[yoke]]) - index]
    at = (tick - int(truth.tick[kept][sample])) / 1000
    how = "pushes" if force > 0.0 else "pulls"
    text = f"{peer} {how} with {abs(force):.0f} N, {at:.2f} s before"
    return text, abs(force) > YOKE * run.traces.config.robot.weight


def _assess_planning(run: ReportedRun, index: int, tick: int) -> Iterator[tuple[str, bool]]:
    config = run.traces.config
    plans = [
        p for p in run.traces.plans[run.traces.robots[index]] if tick - BEFORE_MS < p.tick <= tick
    ]
    if not plans:
        yield "no plans", False
        yield "none", find_kind(config.planner.kind).publishes
        return
    share = float(np.mean([share_at_limit(run, index, plan) for plan in plans]))
    yield f"{100 * share:.0f} % of samples", share > 0.0
    counts: dict[str, int] = {}
    for plan in plans:
        counts[plan.status] = counts.get(plan.status, 0) + 1
    counted = ", ".join(f"{k} {v}" for k, v in counts.items())
    since = tick - plans[-1].tick
    late = since > 2 * step_ms(config)
    yield (
        counted + (f", the last {since} ms before" if late else ""),
        late or set(counts) != {SOLVED},
    )


def share_at_limit(run: ReportedRun, index: int, plan: Plan) -> float:
    """Share of a plan's applied samples with a force at its friction or deviation limit."""
    planner = run.traces.config.planner
    applied = min(planner.applied, len(plan.u))
    if not applied:
        return 0.0
    starts = plan.tick + SAMPLE_MS * np.arange(applied)
    u = plan.u[:applied]
    nominal = nominal_forces(
        scheduled_stance(run.traces.config, index, starts), run.traces.config.robot.weight
    )
    limit = _AT_LIMIT * np.tile(planner.deviation_max, N_LEGS)
    forces = u.reshape(-1, N_LEGS, 3)
    sideways = np.abs(forces[..., :2]).max(axis=-1)
    sliding = (forces[..., 2] > 1.0) & (sideways >= _AT_LIMIT * planner.mu * forces[..., 2])
    full = (np.abs(u - nominal) >= limit) & (np.repeat(forces[..., 2] > 1e-6, 3, axis=1))
    return float((sliding.any(axis=1) | full.any(axis=1)).mean())


def _find_oldest_input(run: ReportedRun, robot: str, tick: int) -> tuple[str, bool]:
    """The oldest of what the agent planned with, by its plans and statuses."""
    traces, step = run.traces, step_ms(run.traces.config)
    usual = 0 if find_kind(run.traces.config.planner.kind).central else 1
    ages: dict[str, tuple[float, bool]] = {}
    for plan in traces.plans[robot]:
        if tick - BEFORE_MS < plan.tick <= tick:
            for peer, used in plan.used.items():
                age = float(step * (plan.step - used))
                late = age > step * (0 if plan.exchange else usual)
                ages[f"plan.{peer}"] = max(ages.get(f"plan.{peer}", (0.0, False)), (age, late))
    for status in traces.statuses[robot]:
        if tick - BEFORE_MS < status.tick <= tick and "reference" in status.ages_ms:
            age = float(status.ages_ms["reference"])
            late = age > REFERENCE.max_age_ms
            ages["reference"] = max(ages.get("reference", (0.0, False)), (age, late))
    if not ages:
        return "unknown", False
    name = max(ages, key=lambda name: (ages[name][1], ages[name][0]))
    return f"{name} {ages[name][0]:.0f} ms", ages[name][1]
