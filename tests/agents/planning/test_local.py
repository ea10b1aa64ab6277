"""When the pilot plans, what it hands on at each tick, and how a plan fades out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from quadriga.agents.gait import nominal_forces, scheduled_stance
from quadriga.agents.modes import STAND, STOPPING, WALK, Mode
from quadriga.agents.planner.planner import PlanResult
from quadriga.agents.planner.qp_solver import Residuals
from quadriga.agents.planning.interface import PlanningInputs, PlanningOutputs, PlanningState
from quadriga.agents.planning.local import LocalPlanning, faded_plan
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config, PlannerConfig, TeamConfig
from quadriga.shared.robot.a1 import Array
from quadriga.shared.wire.messages import Measurement, Plan
from tests.agents.duet import asked, simple_predictor

ALONE = Config(team=TeamConfig(robots=1), planner=PlannerConfig(latency_ms=0))
REFERENCE = asked(0.3)
WALKING = Mode(WALK, 300)
ON_COURSE = np.array([0.26, 0.3, 0.0, 0.0, 0.0, 0.0])
FIRST = 320


@cache
def pilot_of(config: Config) -> LocalPlanning:
    return pilot_with(config, simple_predictor(config))


def pilot_with(config: Config, predictor: Predictor) -> LocalPlanning:
    return LocalPlanning(config, 0, predictor, lambda: 0)


@cache
def coupled(config: Config) -> Predictor:
    """What a peer does moves the other as well."""
    alone = simple_predictor(config)
    G = alone.G.copy()
    G[:, 0, 1] = 0.3 * G[:, 1, 1]
    return Predictor(alone.meta, G)


class ActivePlan:
    """One robot's pilot with samples of our own making."""

    def __init__(self, config: Config = ALONE, predictor: Predictor | None = None) -> None:
        self.config = config
        self.pilot = pilot_of(config) if predictor is None else pilot_with(config, predictor)
        self.state = PlanningState()

    def step(
        self,
        tick: int,
        y: Array = ON_COURSE,
        mode: Mode = WALKING,
        plans: tuple[tuple[str, Plan], ...] = (),
    ) -> PlanningOutputs:
        measurement = None
        if tick % 10 == 0:
            stance = scheduled_stance(self.config, 0, np.array([tick - 10]))[0]
            u = nominal_forces(stance)
            measurement = Measurement(tick, tick * 1_000_000, u, y, stance.astype(float))
        heard = PlanningInputs(tick, mode, (REFERENCE,), measurement, plans=plans)
        self.state, planned = self.pilot.step(self.state, heard)
        return planned

    def fly(self, until: int, y: Array = ON_COURSE) -> PlanningOutputs:
        """All samples up to and including the tick `until`."""
        for tick in range(10, until + 1, 10):
            planned = self.step(tick, y, WALKING if tick >= 300 else Mode(STAND, 0))
        return planned


def test_on_course_the_plan_is_nominal() -> None:
    planned = ActivePlan().fly(FIRST)
    assert planned.plan is not None
    assert planned.plan.status == "solved"
    np.testing.assert_allclose(planned.present.deviation, 0.0, atol=1e-6)


def test_off_course_the_plan_pushes_back_and_is_handed_on_sample_by_sample() -> None:
    slow = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    flight = ActivePlan()
    plan = flight.fly(FIRST, slow).plan
    assert plan is not None
    nominal = nominal_forces(scheduled_stance(ALONE, 0, FIRST + 10 * np.arange(25)))
    assert (plan.u - nominal)[:4, 0].min() > 1.0
    for tick in range(FIRST + 1, FIRST + 40):
        planned = flight.step(tick, slow)
        assert planned.plan is None
        sample = (tick - FIRST) // 10
        np.testing.assert_allclose(planned.present.deviation, (plan.u - nominal)[sample], atol=1e-9)


def test_a_plan_that_is_not_renewed_runs_out() -> None:
    """Samples stop coming: the horizon is used up to its end and nothing after it."""
    slow = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    flight = ActivePlan()
    flight.fly(FIRST, slow)
    state, end = flight.state, FIRST + 10 * ALONE.planner.N
    for tick, expected in ((end - 1, True), (end + 1, False), (end + 1001, False)):
        _, planned = flight.pilot.step(state, PlanningInputs(tick, WALKING, (REFERENCE,)))
        assert planned.plan is None
        assert bool(planned.present.deviation.any()) == expected


@pytest.mark.parametrize("missing", [FIRST - 30, FIRST - 80, FIRST])
def test_without_a_whole_window_of_own_samples_nothing_is_planned(missing: int) -> None:
    flight = ActivePlan()
    for tick in range(10, FIRST + 1, 10):
        if tick != missing:
            planned = flight.step(tick)
    if missing == FIRST:
        _, planned = flight.pilot.step(flight.state, PlanningInputs(FIRST, WALKING, (REFERENCE,)))
    assert planned.plan is None
    assert planned.planner_ns is None
    assert planned.unusual == ("window_gap",)


def test_a_message_from_another_time_is_counted() -> None:
    pair = replace(ALONE, team=TeamConfig(robots=2))
    stray = Measurement(10_000, 0, np.zeros(12), ON_COURSE, np.ones(4))
    heard = PlanningInputs(400, WALKING, (REFERENCE,), measurements=(("r2", stray),))
    _, planned = pilot_of(pair).step(PlanningState(), heard)
    assert planned.unusual.count("refused_by_planner") == 1


def test_a_fallback_is_told_by_its_name_and_not_as_faded() -> None:
    u, y = np.ones((25, 12)), np.zeros((25, 6))
    residuals = Residuals(0.0, 0.0, 0.0)
    for status, told in (("solved", "faded"), ("nominal:infeasible", "nominal:infeasible")):
        result = PlanResult(status, u, np.zeros((25, 12)), y, y, {}, (), residuals, 0)
        assert faded_plan(result, 0.5, (8, 0), 320).status == told
        assert faded_plan(result, 1.0, (8, 0), 320).status == status


@pytest.mark.parametrize("mode", [Mode(STAND, 0), Mode(STOPPING, 300, "why")])
def test_nothing_is_planned_and_nothing_handed_on_unless_walking(mode: Mode) -> None:
    slow = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    flight = ActivePlan()
    flight.fly(FIRST, slow)
    planned = flight.step(FIRST + 40, slow, mode)
    assert planned.plan is None
    assert not planned.present.deviation.any()


@pytest.mark.parametrize(
    ("excess", "share"), [(0.5, 1.0), (1.0, 1.0), (1.25, 0.75), (1.5, 0.5), (2.0, 0.0), (3.0, 0.0)]
)
@pytest.mark.parametrize("output", range(6))
def test_a_plan_fades_out_beyond_the_range_of_the_data(
    output: int, excess: float, share: float
) -> None:
    """In proportion between once and twice the range, in every output, and so it is published."""
    limits = np.array(ALONE.planner.fade)[[0, 1, 1, 2, 2, 3]]
    y = ON_COURSE.copy()
    y[output] += excess * limits[output]
    y[1] -= 0.1 if output != 1 else 0.0  # something to correct in any case
    wide = replace(ALONE, planner=replace(ALONE.planner, fade=(1e3, 1e3, 1e3, 1e3)))
    full, faded = ActivePlan(wide).fly(FIRST, y), ActivePlan().fly(FIRST, y)
    assert full.plan is not None
    assert faded.plan is not None
    assert np.abs(full.present.deviation).max() > 1.0
    np.testing.assert_allclose(faded.present.deviation, share * full.present.deviation, atol=1e-6)
    assert faded.plan.status == ("solved" if share == 1.0 else "faded")
    nominal = nominal_forces(scheduled_stance(ALONE, 0, FIRST + 10 * np.arange(25)))
    np.testing.assert_allclose(faded.plan.u - nominal, share * (full.plan.u - nominal), atol=1e-6)
    # The predictor is linear: what a share of the forces does is that share of what they do.
    G = simple_predictor(ALONE).forced(0, 0)
    effect = (G @ (full.plan.u - nominal).ravel()).reshape(25, 6)
    np.testing.assert_allclose(full.plan.y - faded.plan.y, (1.0 - share) * effect, atol=1e-6)


def test_the_planned_speeds_are_handed_on_with_the_plan() -> None:
    slow = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    planned = ActivePlan().fly(FIRST, slow)
    assert planned.plan is not None
    np.testing.assert_array_equal(planned.present.v_ref, planned.plan.y[:, 1:3])


@pytest.mark.parametrize(("excess", "share"), [(1.25, 0.75), (1.5, 0.5), (2.0, 0.0), (3.0, 0.0)])
def test_the_speeds_of_a_plan_that_fades_out_give_way_to_those_asked_for(
    excess: float, share: float
) -> None:
    """What is published stays what the forces come to: without any, that is the free response."""
    y = ON_COURSE + np.array([0.0, excess * ALONE.planner.fade[1], 0.0, 0.0, 0.0, 0.0])
    wide = replace(ALONE, planner=replace(ALONE.planner, fade=(1e3, 1e3, 1e3, 1e3)))
    full, faded = ActivePlan(wide).fly(FIRST, y), ActivePlan().fly(FIRST, y)
    assert full.plan is not None
    assert faded.plan is not None
    assert faded.present.v_ref is not None
    wish = ON_COURSE[1:3]
    expected = wish + share * (full.plan.y[:, 1:3] - wish)
    np.testing.assert_allclose(faded.present.v_ref, expected, atol=1e-12)
    assert np.abs(faded.plan.y[:, 1:3] - expected).max() > 1e-3


def test_a_fallback_follows_the_speeds_asked_for() -> None:
    y = ON_COURSE - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    limits = replace(ALONE.planner, force_min=200.0, deviation_max=(20.0, 20.0, 5.0))
    planned = ActivePlan(replace(ALONE, planner=limits)).fly(FIRST, y)
    assert planned.plan is not None
    assert planned.plan.status == "nominal:infeasible"
    np.testing.assert_array_equal(planned.present.v_ref, np.tile(ON_COURSE[1:3], (25, 1)))
    assert planned.plan.y[0, 1] < 0.25  # nominal forces alone do not mend it at once


@pytest.mark.parametrize(
    ("absurd", "back"), [(np.nan, 0), (np.inf, 0), (1e170, 0), (1e6, 0), (np.nan, 30), (np.inf, 30)]
)
def test_a_plan_of_absurd_samples_is_nominal_by_name_and_follows_what_is_asked_for(
    absurd: float, back: int
) -> None:
    """The newest sample tells of the fading too."""
    flight, broken = ActivePlan(), ON_COURSE.copy()
    broken[1] = absurd
    for tick in range(10, FIRST + 1, 10):
        mode = WALKING if tick >= 300 else Mode(STAND, 0)
        planned = flight.step(tick, broken if tick == FIRST - back else ON_COURSE, mode)
    assert planned.plan is not None
    assert planned.plan.status.startswith("nominal:")
    nominal = nominal_forces(scheduled_stance(ALONE, 0, FIRST + 10 * np.arange(25)))
    np.testing.assert_array_equal(planned.plan.u, nominal)
    np.testing.assert_array_equal(planned.plan.y, np.tile(ON_COURSE, (25, 1)))
    assert not planned.present.deviation.any()
    np.testing.assert_array_equal(planned.present.v_ref, np.tile(ON_COURSE[1:3], (25, 1)))


@pytest.mark.parametrize("absurd", [1e39, 1e300, np.nan])
@pytest.mark.parametrize("name", ["u", "y"])
def test_absurd_numbers_of_a_peer_do_not_enter_a_plan(absurd: float, name: str) -> None:
    pair = replace(ALONE, team=TeamConfig(robots=2))
    flight = ActivePlan(pair, coupled(pair))
    expected = ActivePlan(pair, coupled(pair)).fly(FIRST).plan
    assert expected is not None
    for tick in range(10, FIRST + 1, 10):
        plans: tuple[tuple[str, Plan], ...] = ()
        if tick == FIRST - 10:  # made of one's own, which any could be
            claim = replace(expected, tick=FIRST - 40, step=FIRST // 40 - 1)
            plans = (("r2", replace(claim, **{name: np.full_like(getattr(claim, name), absurd)})),)
        planned = flight.step(tick, ON_COURSE, WALKING if tick >= 300 else Mode(STAND, 0), plans)
        assert planned.unusual.count("refused_by_planner") == len(plans)
    assert planned.plan is not None
    np.testing.assert_array_equal(planned.plan.u, expected.u)
    np.testing.assert_array_equal(planned.plan.y, expected.y)


def test_the_first_plan_waits_for_the_window_when_the_stand_is_short() -> None:
    config = replace(ALONE, gait=replace(ALONE.gait, stand_ms=100))
    flight = ActivePlan(config)
    planned = [tick for tick in range(10, 400, 10) if flight.step(tick).plan is not None]
    assert planned[0] == 160  # (10 + 4 samples) up to the next 40 ms


PATIENCE = ALONE.planner.max_peer_age + ALONE.planner.hold_steps


def stop_of(flight: ActivePlan, ticks: range, missing: Callable[[int], bool]) -> tuple[int, str]:
    """Tick and reason of the first stop while some ticks are not there at all; (−1, "") if none."""
    for tick in ticks:
        if missing(tick):
            continue
        planned = flight.step(tick, ON_COURSE, WALKING if tick >= 300 else Mode(STAND, 0))
        if planned.stop_reason:
            return tick, planned.stop_reason
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
    tick, reason = stop_of(ActivePlan(), range(10, 2000, 5), missing)
    assert reason == "window-lost"
    assert tick // 40 == FIRST // 40 + PATIENCE
    flight = ActivePlan()
    flight.fly(440)
    tick, reason = stop_of(flight, range(445, 2000, 5), lambda tick: tick % 10 == 0)
    assert (tick // 40, reason) == (440 // 40 + PATIENCE + 1, "window-lost")


@pytest.mark.parametrize("missing", [every_ninth_sample, every_planning_step])
def test_a_silent_peer_is_given_up_in_time_whatever_its_own_samples_are(
    missing: Callable[[int], bool],
) -> None:
    """Here the agent planned once in between, so that it does not stop for its own sake."""
    pair = replace(ALONE, team=TeamConfig(robots=2))
    whole, broken = ActivePlan(pair), ActivePlan(pair)
    tick, reason = stop_of(whole, range(10, 2000, 5), lambda _: False)
    assert (tick, reason) == (FIRST + 40 * (PATIENCE + 1), "peer-lost:r2")
    assert stop_of(broken, range(10, FIRST + 81, 5), lambda _: False) == (-1, "")
    later, reason = stop_of(broken, range(FIRST + 85, 2000, 5), missing)
    assert reason == "peer-lost:r2"
    assert tick <= later <= tick + 5


@pytest.mark.parametrize("T_ini", [10, 50])
def test_who_begins_to_walk_late_has_time_to_fill_its_window(T_ini: int) -> None:
    flight = ActivePlan(replace(ALONE, planner=replace(ALONE.planner, T_ini=T_ini)))
    ticks, late = range(5000, 5600, 10), Mode(WALK, 5000)
    seen = [flight.step(tick, ON_COURSE, late) for tick in ticks]
    assert {planned.stop_reason for planned in seen} == {""}
    made = [tick for tick, planned in zip(ticks, seen, strict=True) if planned.plan is not None]
    assert made[0] == -(-(5000 + 10 * (T_ini - 1)) // 40) * 40
    lonely = ActivePlan(replace(ALONE, team=TeamConfig(robots=2)))
    assert {lonely.step(t, ON_COURSE, late).stop_reason for t in range(5000, 5080, 10)} == {""}
