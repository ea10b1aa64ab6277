"""When the agent plans, what it hands on at each tick, and how a plan fades out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from quadriga.agents.gait import scheduled_stance
from quadriga.agents.planning.interface import PlanningInputs, PlanningOutputs
from quadriga.agents.planning.local import LocalPlanning
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.modes import STAND, STOPPING, WALK, Mode
from quadriga.shared.robots.conventions import Array
from tests.a1 import nominal_forces
from tests.agents.duet import Planned, asked, coupled, simple_predictor

ALONE = Config(team=TeamConfig(robots=1), planner=PlannerConfig(latency_ms=0))
REFERENCE = asked(0.3)
WALKING = Mode(WALK, 300)
ON_COURSE = np.array([0.26, 0.3, 0.0, 0.0, 0.0, 0.0])
FIRST = 320


@cache
def planning_of(config: Config) -> LocalPlanning:
    return LocalPlanning(config, 0, simple_predictor(config), lambda: 0)


class Walker(Planned):
    """One robot's planning with samples of our own making."""

    def __init__(self, config: Config = ALONE, predictor: Predictor | None = None) -> None:
        self.config, planning = config, planning_of(config)
        if predictor is not None:
            planning = LocalPlanning(config, 0, predictor, lambda: 0)
        super().__init__(config, 0, planning)

    def sample(
        self,
        tick: int,
        y: Array = ON_COURSE,
        mode: Mode | None = None,
        plans: tuple[tuple[str, Plan], ...] = (),
    ) -> PlanningOutputs:
        measurement = None
        if tick % 10 == 0:
            stance = scheduled_stance(self.config, 0, np.array([tick - 10]))[0]
            u = nominal_forces(stance)
            measurement = Measurement(tick, tick * 1_000_000, u, y, stance.astype(float))
        mode = mode or (WALKING if tick >= 300 else Mode(STAND, 0))
        return self.step(PlanningInputs(tick, mode, (REFERENCE,), measurement, plans=plans))

    def walk(self, until: int, y: Array = ON_COURSE) -> PlanningOutputs:
        """All samples up to and including the tick `until`."""
        for tick in range(10, until + 1, 10):
            outputs = self.sample(tick, y)
        return outputs


def test_off_course_the_plan_pushes_back_and_is_handed_on_sample_by_sample() -> None:
    slow = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    walker = Walker()
    plan = walker.walk(FIRST, slow).plan
    assert plan is not None
    nominal = nominal_forces(scheduled_stance(ALONE, 0, FIRST + 10 * np.arange(25)))
    assert (plan.u - nominal)[:4, 0].min() > 1.0
    for tick in range(FIRST + 1, FIRST + 40):
        outputs = walker.sample(tick, slow)
        assert outputs.plan is None
        sample = (tick - FIRST) // 10
        deviation = walker.applied(tick).deviation
        np.testing.assert_allclose(deviation, (plan.u - nominal)[sample], atol=1e-9)


def test_a_plan_that_is_not_renewed_runs_out() -> None:
    """Samples stop coming: the horizon is used up to its end and nothing after it."""
    slow = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    walker = Walker()
    walker.walk(FIRST, slow)
    end = FIRST + 10 * ALONE.planner.N
    for tick, expected in ((end - 1, True), (end + 1, False), (end + 1001, False)):
        outputs = walker.step(PlanningInputs(tick, WALKING, (REFERENCE,)))
        assert outputs.plan is None
        assert bool(walker.applied(tick).deviation.any()) == expected


@pytest.mark.parametrize("missing", [FIRST - 30, FIRST - 80, FIRST])
def test_without_a_whole_window_of_own_samples_nothing_is_planned(missing: int) -> None:
    walker = Walker()
    for tick in range(10, FIRST + 1, 10):
        if tick != missing:
            outputs = walker.sample(tick, mode=WALKING)
    if missing == FIRST:
        outputs = walker.step(PlanningInputs(FIRST, WALKING, (REFERENCE,)))
    assert outputs.plan is None
    assert outputs.planner_ns is None
    assert outputs.unusual == ("window_gap",)


@pytest.mark.parametrize("mode", [Mode(STAND, 0), Mode(STOPPING, 300, "why")])
def test_nothing_is_planned_and_nothing_handed_on_unless_walking(mode: Mode) -> None:
    slow = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    walker = Walker()
    walker.walk(FIRST, slow)
    outputs = walker.sample(FIRST + 40, slow, mode)
    assert outputs.plan is None
    assert not walker.applied(FIRST + 40).deviation.any()


@pytest.mark.parametrize(
    ("excess", "share"), [(0.5, 1.0), (1.0, 1.0), (1.25, 0.75), (1.5, 0.5), (2.0, 0.0), (3.0, 0.0)]
)
@pytest.mark.parametrize("output", range(6))
def test_a_plan_fades_out_beyond_the_range_of_the_data(
    output: int, excess: float, share: float
) -> None:
    """In proportion between once and twice the range, in every output, and so it is published."""
    limits = np.array(ALONE.planner.trust_range)[[0, 1, 1, 2, 2, 3]]
    y = ON_COURSE.copy()
    y[output] += excess * limits[output]
    y[1] -= 0.1 if output != 1 else 0.0  # something to correct in any case
    wide = replace(ALONE, planner=replace(ALONE.planner, trust_range=(1e3, 1e3, 1e3, 1e3)))
    sure, wary = Walker(wide), Walker()
    full, faded = sure.walk(FIRST, y), wary.walk(FIRST, y)
    assert full.plan is not None
    assert faded.plan is not None
    whole = sure.applied(FIRST).deviation
    assert np.abs(whole).max() > 1.0
    np.testing.assert_allclose(wary.applied(FIRST).deviation, share * whole, atol=1e-6)
    assert faded.plan.status == ("solved" if share == 1.0 else "faded")
    nominal = nominal_forces(scheduled_stance(ALONE, 0, FIRST + 10 * np.arange(25)))
    np.testing.assert_allclose(faded.plan.u - nominal, share * (full.plan.u - nominal), atol=1e-6)
    # The predictor is linear: what a share of the forces does is that share of what they do.
    G = simple_predictor(ALONE).future_block(0, 0)
    effect = (G @ (full.plan.u - nominal).ravel()).reshape(25, 6)
    np.testing.assert_allclose(full.plan.y - faded.plan.y, (1.0 - share) * effect, atol=1e-6)
    # Followed are the planned outputs, as far as the plan is applied, else those asked for.
    expected = ON_COURSE + share * (full.plan.y[0] - ON_COURSE)
    y_ref = wary.applied(FIRST).y_ref
    assert y_ref is not None
    np.testing.assert_allclose(y_ref, expected, atol=1e-12)


def test_a_fallback_follows_the_speeds_asked_for() -> None:
    """It is told by its name, also where little of a plan would be applied."""
    y = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    y[5] += 1.5 * ALONE.planner.trust_range[3]
    limits = replace(ALONE.planner, force_min=200.0, deviation_max=(20.0, 20.0, 5.0))
    walker = Walker(replace(ALONE, planner=limits))
    outputs = walker.walk(FIRST, y)
    assert outputs.plan is not None
    assert outputs.plan.status == "nominal:infeasible"
    np.testing.assert_array_equal(walker.applied(FIRST).y_ref, ON_COURSE)
    assert outputs.plan.y[0, 1] < 0.25  # nominal forces alone do not mend it at once


@pytest.mark.parametrize(
    ("absurd", "back", "status"),
    [
        (np.nan, 0, "not-finite"),
        (1e170, 0, "not-finite"),
        (1e6, 0, "implausible"),
        (np.inf, 30, "not-finite"),
    ],
)
def test_a_plan_of_absurd_samples_is_nominal_by_name_and_follows_what_is_asked_for(
    absurd: float, back: int, status: str
) -> None:
    """The newest sample tells of the fading too."""
    walker, broken = Walker(), ON_COURSE.copy()
    broken[1] = absurd
    for tick in range(10, FIRST + 1, 10):
        outputs = walker.sample(tick, broken if tick == FIRST - back else ON_COURSE)
    assert outputs.plan is not None
    assert outputs.plan.status == f"nominal:{status}"
    nominal = nominal_forces(scheduled_stance(ALONE, 0, FIRST + 10 * np.arange(25)))
    np.testing.assert_array_equal(outputs.plan.u, nominal)
    np.testing.assert_array_equal(outputs.plan.y, np.tile(ON_COURSE, (25, 1)))
    assert not walker.applied(FIRST).deviation.any()
    np.testing.assert_array_equal(walker.applied(FIRST).y_ref, ON_COURSE)


@pytest.mark.parametrize(("name", "absurd"), [("u", 1e39), ("y", np.nan)])
def test_absurd_numbers_of_a_peer_do_not_enter_a_plan(name: str, absurd: float) -> None:
    pair = replace(ALONE, team=TeamConfig(robots=2))
    walker = Walker(pair, coupled(pair))
    expected = Walker(pair, coupled(pair)).walk(FIRST).plan
    assert expected is not None
    for tick in range(10, FIRST + 1, 10):
        plans: tuple[tuple[str, Plan], ...] = ()
        if tick == FIRST - 10:  # made of one's own, which any could be
            claim = replace(expected, tick=FIRST - 40, step=FIRST // 40 - 1)
            plans = (("r2", replace(claim, **{name: np.full_like(getattr(claim, name), absurd)})),)
        outputs = walker.sample(tick, plans=plans)
        assert outputs.unusual.count("refused_by_planner") == len(plans)
    assert outputs.plan is not None
    np.testing.assert_array_equal(outputs.plan.u, expected.u)
    np.testing.assert_array_equal(outputs.plan.y, expected.y)


def test_the_first_plan_waits_for_the_window_when_the_stand_is_short() -> None:
    config = replace(ALONE, gait=replace(ALONE.gait, stand_ms=100))
    walker = Walker(config)
    outputs = [
        tick for tick in range(10, 400, 10) if walker.sample(tick, mode=WALKING).plan is not None
    ]
    assert outputs[0] == 160  # (10 + 4 samples) up to the next 40 ms


PATIENCE = ALONE.planner.max_peer_age + ALONE.planner.hold_steps


def stop_of(walker: Walker, ticks: range, missing: Callable[[int], bool]) -> tuple[int, str]:
    """Tick and reason of the first stop while some ticks are not there at all; (−1, "") if none."""
    for tick in ticks:
        if missing(tick):
            continue
        outputs = walker.sample(tick)
        if outputs.stop_reason:
            return tick, outputs.stop_reason
    return -1, ""


def every_ninth_sample(tick: int) -> bool:
    return tick % 90 == 0


def every_planning_step(tick: int) -> bool:
    return tick >= FIRST and tick % 40 == 0


@pytest.mark.parametrize("missing", [every_ninth_sample, every_planning_step])
def test_without_a_plan_of_its_own_it_walks_only_as_long_as_for_a_silent_peer(
    missing: Callable[[int], bool],
) -> None:
    """Also where the very ticks of the planning steps are those that are lost."""
    tick, reason = stop_of(Walker(), range(10, 2000, 5), missing)
    assert reason == "window-lost"
    assert tick // 40 == FIRST // 40 + PATIENCE
    walker = Walker()
    walker.walk(440)
    tick, reason = stop_of(walker, range(445, 2000, 5), lambda tick: tick % 10 == 0)
    assert (tick // 40, reason) == (440 // 40 + PATIENCE + 1, "window-lost")


@pytest.mark.parametrize("missing", [every_ninth_sample, every_planning_step])
def test_a_silent_peer_is_given_up_in_time_whatever_its_own_samples_are(
    missing: Callable[[int], bool],
) -> None:
    """Here the agent outputs once in between, so that it does not stop for its own sake."""
    pair = replace(ALONE, team=TeamConfig(robots=2))
    whole, broken = Walker(pair), Walker(pair)
    tick, reason = stop_of(whole, range(10, 2000, 5), lambda _: False)
    assert (tick, reason) == (FIRST + 40 * (PATIENCE + 1), "peer-lost:r2")
    assert stop_of(broken, range(10, FIRST + 81, 5), lambda _: False) == (-1, "")
    later, reason = stop_of(broken, range(FIRST + 85, 2000, 5), missing)
    assert reason == "peer-lost:r2"
    assert tick <= later <= tick + 5


@pytest.mark.parametrize("T_ini", [10, 50])
def test_who_begins_to_walk_late_has_time_to_fill_its_window(T_ini: int) -> None:
    walker = Walker(replace(ALONE, planner=replace(ALONE.planner, T_ini=T_ini)))
    ticks, late = range(5000, 5600, 10), Mode(WALK, 5000)
    seen = [walker.sample(tick, ON_COURSE, late) for tick in ticks]
    assert {outputs.stop_reason for outputs in seen} == {""}
    made = [tick for tick, outputs in zip(ticks, seen, strict=True) if outputs.plan is not None]
    assert made[0] == -(-(5000 + 10 * (T_ini - 1)) // 40) * 40
    lonely = Walker(replace(ALONE, team=TeamConfig(robots=2)))
    assert {lonely.sample(t, ON_COURSE, late).stop_reason for t in range(5000, 5080, 10)} == {""}


def test_a_message_from_another_time_is_counted() -> None:
    pair = replace(ALONE, team=TeamConfig(robots=2))
    stray = Measurement(10_000, 0, np.zeros(12), ON_COURSE, np.ones(4))
    planning = planning_of(pair)
    arrived = PlanningInputs(400, WALKING, (REFERENCE,), measurements=(("r2", stray),))
    _, outputs = planning.step(planning.initial(), arrived)
    assert outputs.unusual.count("refused_by_planner") == 1
