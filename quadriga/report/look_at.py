"""What to look at: for each fall or fault the second before it, robot by robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from agents.gait import nominal_forces, scheduled_stance
from agents.modes import DAMPING, ESTOP
from agents.planner.horizon import SAMPLE_MS, step_ms
from quadriga.report.moments import FALL, STOP, Moment
from quadriga.report.path import spells
from quadriga.report.run import Run
from quadriga.report.samples import Samples, slipping
from shared.messages import Plan
from shared.robot import N_LEGS, Leg
from shared.topics import REFERENCE

BEFORE_MS: Final = 1000
AFTER_MS: Final = 200  # shown in the figure, not judged
_TOGETHER_MS: Final = 200  # troubles this close are one episode
TILT: Final = 0.25  # rad; walks on rough ground stay below
SLIP: Final = 0.2  # m/s; feet in stance roll at up to 0.06
_LOST_MS: Final = 40  # ms of scheduled stance without contact
_TORQUE: Final = 0.98  # share of the limit
_TELLING: Final = ("push", "plan", "counted", "gap", "mode")  # kinds of moments that are signs
_LIMP: Final = (f"({DAMPING})", f"({ESTOP})")
_AT_LIMIT: Final = 0.99  # share of a planned force's limit


@dataclass(frozen=True, slots=True)
class Sign:
    """Something out of the ordinary: when it began, of whom, what."""

    tick: int
    robot: str
    text: str


@dataclass(frozen=True, slots=True)
class Account:
    """One robot's second, in words; what is out of the ordinary is marked."""

    robot: str
    cells: tuple[tuple[str, bool], ...]


COLUMNS: Final = (
    "tilt at the end", "greatest tilt", "fastest slip", "stance without ground",
    "torque at most", "planned force at a limit", "plans", "oldest input",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Episode:
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


def episodes(run: Run) -> list[Episode]:
    """All troubles of a run, those that come together as one."""
    groups: list[list[Moment]] = []
    for moment in run.moments:
        if moment.trouble:
            if groups and moment.tick - groups[-1][0].tick <= _TOGETHER_MS:
                groups[-1].append(moment)
            else:
                groups.append([moment])
    return [_episode(run, group) for group in groups]


def _episode(run: Run, troubles: Sequence[Moment]) -> Episode:
    tick = troubles[0].tick
    signs = [
        Sign(m.tick, m.robot, f"{m.kind}: {m.text}" if m.text else m.kind)
        for m in run.moments
        if m.kind in _TELLING
        and tick - BEFORE_MS <= m.stop
        and m.tick <= tick
        and _down_since(run, m.robot, tick) is None
    ]
    for robot in run.traces.robots:
        if _down_since(run, robot, tick) is None:
            signs += _signs(robot, _window(run.samples[robot], tick))
    signs += _planless(run, tick)
    signs.sort(key=lambda sign: sign.tick)
    accounts = tuple(_account(run, index, tick) for index in range(len(run.traces.robots)))
    return Episode(tick, tuple(troubles), tuple(signs), accounts)


def _down_since(run: Run, robot: str, tick: int) -> int | None:
    """When a robot went limp, if that was some time before `tick`: then its second says nothing."""
    for moment in run.moments:
        limp = moment.kind == FALL or (moment.kind == STOP and moment.text.endswith(_LIMP))
        if moment.robot == robot and limp and moment.tick < tick - _TOGETHER_MS:
            return moment.tick
    return None


def _window(samples: Samples, tick: int) -> Samples:
    """The second up to `tick`."""
    kept = (samples.tick > tick - BEFORE_MS) & (samples.tick <= tick)
    values = [getattr(samples, name)[kept] for name in Samples.__slots__]
    return Samples(*values)


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
        yield from first(_airborne(window, leg), f"{leg.name} finds no ground in its stance")
    yield from first(spells(window.torque >= _TORQUE), "a joint at its torque limit")


def _planless(run: Run, tick: int) -> Iterator[Sign]:
    """Robots that made no plan in the second up to `tick`, although others did."""
    begin = tick - BEFORE_MS
    made = {
        robot: any(begin < plan.tick <= tick for plan in plans)
        for robot, plans in run.traces.plans.items()
    }
    for robot, planned in made.items():
        if any(made.values()) and not planned and _down_since(run, robot, tick) is None:
            yield Sign(max(begin, run.begin), robot, "makes no plan in this second")


def _airborne(window: Samples, leg: int) -> list[tuple[int, int]]:
    lost = window.stance[:, leg] & ~window.contact[:, leg]
    return [(a, b) for a, b in spells(lost) if SAMPLE_MS * (b - a) >= _LOST_MS]


def _account(run: Run, index: int, tick: int) -> Account:
    robot = run.traces.robots[index]
    if (down := _down_since(run, robot, tick)) is not None:
        return Account(robot, ((f"down since {down / 1000:.2f} s", False),))
    window = _window(run.samples[robot], tick)
    return Account(robot, (
        *_trunk(window), *_feet(window), *_planning(run, index, tick), _age(run, robot, tick),
    ))  # fmt: skip


def _trunk(window: Samples) -> Iterator[tuple[str, bool]]:
    if not len(window.tick):
        yield from [("not recorded", False)] * 2
        return
    for tilt in (float(window.tilt[-1]), float(window.tilt.max())):
        yield f"{tilt:.2f} rad", tilt > TILT


def _feet(window: Samples) -> Iterator[tuple[str, bool]]:
    if not len(window.tick):
        yield from [("not recorded", False)] * 3
        return
    slip = slipping(window)
    speed = np.where(window.stance & window.contact, np.nan_to_num(window.foot_speed), 0.0)
    leg = Leg(int(speed.max(axis=0).argmax())).name
    fastest = float(slip.max())
    unknown = not np.isfinite(window.foot_speed).any()
    yield ("unknown" if unknown else f"{fastest:.2f} m/s, {leg}"), fastest > SLIP
    lost = {Leg(k).name: sum(b - a for a, b in _airborne(window, k)) for k in range(N_LEGS)}
    named = ", ".join(f"{name} {SAMPLE_MS * count} ms" for name, count in lost.items() if count)
    yield named or "none", bool(named)
    torque = float(window.torque.max())
    yield f"{100 * min(torque, 1.0):.0f} %", torque >= _TORQUE


def _planning(run: Run, index: int, tick: int) -> Iterator[tuple[str, bool]]:
    config = run.traces.config
    plans = [
        p for p in run.traces.plans[run.traces.robots[index]] if tick - BEFORE_MS < p.tick <= tick
    ]
    if not plans:
        yield "no plans", False
        yield "none", config.planner.kind != "none"
        return
    share = float(np.mean([at_limit(run, index, plan) for plan in plans]))
    yield f"{100 * share:.0f} % of samples", share > 0.0
    counts: dict[str, int] = {}
    for plan in plans:
        counts[plan.status] = counts.get(plan.status, 0) + 1
    told = ", ".join(f"{k} {v}" for k, v in counts.items())
    since = tick - plans[-1].tick
    late = since > 2 * step_ms(config)
    yield (
        told + (f", the last {since} ms before" if late else ""),
        late or set(counts) != {"solved"},
    )


def at_limit(run: Run, index: int, plan: Plan) -> float:
    """Share of a plan's applied samples with a force at its friction or deviation limit."""
    planner = run.traces.config.planner
    applied = min(planner.applied, len(plan.u))
    starts = plan.tick + SAMPLE_MS * np.arange(applied)
    u = plan.u[:applied]
    nominal = nominal_forces(scheduled_stance(run.traces.config, index, starts))
    limit = _AT_LIMIT * np.tile(planner.deviation_max, N_LEGS)
    forces = u.reshape(-1, N_LEGS, 3)
    sideways = np.abs(forces[..., :2]).max(axis=-1)
    sliding = (forces[..., 2] > 1.0) & (sideways >= _AT_LIMIT * planner.mu * forces[..., 2])
    full = (np.abs(u - nominal) >= limit) & (np.repeat(forces[..., 2] > 1e-6, 3, axis=1))
    return float((sliding.any(axis=1) | full.any(axis=1)).mean())


def _age(run: Run, robot: str, tick: int) -> tuple[str, bool]:
    """The oldest of what the agent planned with, as its plans and statuses say."""
    traces, step = run.traces, step_ms(run.traces.config)
    usual = 0 if run.traces.config.planner.kind in ("centralised", "deepc") else 1
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
