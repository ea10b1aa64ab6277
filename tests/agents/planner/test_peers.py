"""The one-step-delay protocol under loss, repetition, reordering and foreign messages."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.gait import horizon_stance, scheduled_stance
from quadriga.agents.planner.peers import (
    LOST,
    SILENT,
    USABLE,
    Neighbours,
    PeerData,
    PeerMemory,
    PeerTerms,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.robots.conventions import Array
from tests.a1 import nominal_forces

CONFIG = Config()
CONFIG = replace(
    CONFIG, planner=replace(CONFIG.planner, N=16, T_ini=6, max_peer_age=2, hold_steps=3)
)
PLANNER = CONFIG.planner
NEIGHBOURS = Neighbours(CONFIG, 0)
FIRST = 10
INDEX = {"r2": 1, "r3": 2}


def mark(robot: str, tick: int) -> float:
    """A deviation that tells whose sample it is and when."""
    return 1e-4 * tick + 10.0 * INDEX[robot]


def told(step: int, k: Any) -> Any:
    """The deviation that a plan of step `step` tells of its sample k."""
    return 0.1 * step + 1e-3 * k


def measurement(robot: str, tick: int) -> Measurement:
    start = np.array([tick - 10])
    stance = scheduled_stance(CONFIG, INDEX[robot], start)[0]
    u = nominal_forces(stance) + mark(robot, tick)
    return Measurement(tick, 0, u=u, y=np.full(6, mark(robot, tick)), stance=stance.astype(float))


def plan(robot: str, step: int, exchange: int = 0) -> Plan:
    """The plan of a step, its samples as `told`."""
    nominal = nominal_forces(horizon_stance(CONFIG, INDEX[robot], step))
    k = np.arange(PLANNER.N)[:, None]
    return Plan(
        40 * step,
        0,
        step=step,
        u=nominal + told(step, k),
        y=np.tile(told(step, k), (1, 6)),
        status="solved",
        used={},
        exchange=exchange,
    )


def remember(step: int, plans: list[int], ticks: list[int], robot: str = "r2") -> PeerMemory:
    return NEIGHBOURS.remember(
        NEIGHBOURS.initial(),
        40 * step,
        [(robot, measurement(robot, tick)) for tick in ticks],
        [(robot, plan(robot, s)) for s in plans],
    )


def of(memory: PeerMemory, step: int, robot: str = "r2") -> PeerData:
    peers = NEIGHBOURS.select(memory, step - 1, FIRST, step - 1)
    return next(peer for peer in peers if peer.robot == robot)


def window_ticks(step: int) -> list[int]:
    """Ticks of the T_ini samples that end at step k−1."""
    return [40 * (step - 1) - 10 * back for back in range(PLANNER.T_ini - 1, -1, -1)]


def expected_du(step: int, age: int) -> Array:
    """The plan of step − 1 − age, shifted: its first 4 samples per step of age are gone."""
    deviation = told(step - 1 - age, np.arange(PLANNER.N))
    shifted = np.zeros(PLANNER.N)
    shifted[: PLANNER.N - 4 * age] = deviation[4 * age :]
    return np.tile(shifted[:, None], (1, 12))


@pytest.mark.parametrize(
    ("age", "status"), [(0, USABLE), (1, USABLE), (2, USABLE), (3, SILENT), (5, SILENT), (6, LOST)]
)
def test_a_missing_plan_is_replaced_by_the_newest_one_shifted_then_the_peer_is_silent_then_lost(
    age: int, status: str
) -> None:
    newest = 19 - age
    memory = remember(newest, [newest - 1, newest], [])
    memory = NEIGHBOURS.remember(memory, 40 * 20, [("r2", measurement("r2", 760))], [])
    peer = of(memory, 20)
    assert (peer.status, peer.step, peer.age) == (status, newest, age)
    if status == USABLE:
        np.testing.assert_allclose(peer.du, expected_du(20, age), atol=1e-9)
    terms = PeerTerms(peers=NEIGHBOURS.select(memory, 19, FIRST, 19))
    assert terms.lost == NEIGHBOURS.lost_peers(memory, 19, FIRST)
    assert ("r2" in terms.lost) == (status == LOST)


def test_the_first_planning_step_needs_nobodys_plan() -> None:
    memory = remember(FIRST, [], window_ticks(FIRST))
    peers = NEIGHBOURS.select(memory, FIRST - 1, FIRST, FIRST - 1)
    assert PeerTerms(peers=peers).used == {}
    assert [peer.status for peer in peers] == [USABLE, USABLE]
    assert all((peer.du == 0).all() for peer in peers)
    assert peers[0].known.all()
    assert not peers[1].known.any()


def test_a_peer_that_never_plans_is_lost_in_the_end() -> None:
    memory = NEIGHBOURS.initial()
    seen = [of(memory, step).status for step in range(FIRST, FIRST + 7)]
    assert seen == [USABLE] * 3 + [SILENT] * 3 + [LOST]


@pytest.mark.parametrize(
    ("stands_at", "step", "status"),
    [
        (760, 21, USABLE),  # it planned since: it walks again
        (800, 21, USABLE),  # the sample of the very tick of its plan
        (810, 22, LOST),
        (840, 22, LOST),
        (850, 22, USABLE),  # later than what may be used
    ],
)
def test_a_peer_that_has_come_to_stand_since_its_plan_is_lost_at_once(
    stands_at: int, step: int, status: str
) -> None:
    walked = [("r2", measurement("r2", tick)) for tick in range(700, stands_at, 10)]
    stood = replace(measurement("r2", stands_at), stance=np.ones(4))
    memory = NEIGHBOURS.remember(
        NEIGHBOURS.initial(), 40 * step + 10, [*walked, ("r2", stood)], [("r2", plan("r2", 20))]
    )
    assert of(memory, step).status == status
    assert ("r2" in NEIGHBOURS.lost_peers(memory, step - 1, FIRST)) == (status == LOST)


def test_foreign_and_absurd_messages_are_refused_and_counted() -> None:
    """Of forces those, too, that no leg can carry."""
    now = 40 * 20
    good = plan("r2", 20)
    bad_plans = [
        ("r1", good), ("r9", good),
        ("r2", replace(good, tick=good.tick + 40)),
        ("r2", replace(good, u=good.u[:-1], y=good.y[:-1])),
        ("r2", replace(good, step=2000, tick=80000)),
        ("r2", replace(good, step=1, tick=40)),
    ]  # fmt: skip
    bad_samples = [
        ("r1", measurement("r2", now)),
        ("r2", measurement("r2", now - 5)),
        ("r2", measurement("r2", now + 10**6)),
        ("r2", measurement("r2", 0)),
    ]
    for name, absurd in (
        ("u", 1e39), ("y", -1e39), ("y", np.nan), ("u", np.inf), ("u", 1200.0), ("u", -600.0)
    ):  # fmt: skip
        sample = measurement("r2", now)
        one, other = getattr(good, name).copy(), getattr(sample, name).copy()
        one[-1, -1] = other[-1] = absurd
        bad_plans.append(("r2", replace(good, **{name: one})))
        bad_samples.append(("r2", replace(sample, **{name: other})))
    memory = NEIGHBOURS.remember(NEIGHBOURS.initial(), now, bad_samples, bad_plans)
    assert memory.refused == len(bad_plans) + len(bad_samples)
    assert memory.peers == NEIGHBOURS.initial().peers


def test_the_largest_forces_that_may_be_planned_are_taken() -> None:
    strong = replace(CONFIG, planner=replace(PLANNER, deviation_max=(20.0, 20.0, 5e3)))
    good = plan("r2", 20)
    pushing = replace(good, u=good.u + np.tile([20.0, 20.0, 5e3], 4))
    for config, refused in ((strong, 0), (CONFIG, 1)):
        neighbours = Neighbours(config, 0)
        memory = neighbours.remember(neighbours.initial(), 800, [], [("r2", pushing)])
        assert memory.refused == refused


def test_memory_stays_small() -> None:
    memory = NEIGHBOURS.initial()
    for tick in range(0, 8000, 10):
        plans = [("r2", plan("r2", tick // 40))] if tick % 40 == 0 else []
        memory = NEIGHBOURS.remember(memory, tick, [("r2", measurement("r2", tick))], plans)
    assert len(memory.peers["r2"].measurements) <= 6 + 4 * 7 + 1
    assert len(memory.peers["r2"].plans) <= 10
    assert memory.refused == 0


@settings(max_examples=60, deadline=None)
@given(
    lost_plans=st.sets(st.integers(FIRST, 24)),
    lost_samples=st.sets(st.integers(30, 100)),
    order=st.randoms(use_true_random=False),
    copies=st.integers(1, 2),
)
def test_loss_repetition_and_reordering(
    lost_plans: set[int], lost_samples: set[int], order: object, copies: int
) -> None:
    """What is selected depends only on the set of messages up to k−1, and follows the rule."""
    step = 22
    steps = [s for s in range(FIRST, step + 1) if s not in lost_plans]
    ticks = [10 * i for i in range(40, 4 * step + 1) if i not in lost_samples]
    arrivals = [("plan", s) for s in steps] * copies + [("sample", t) for t in ticks] * copies
    order.shuffle(arrivals)  # type: ignore[attr-defined]
    memory = NEIGHBOURS.initial()
    for kind, value in arrivals:
        memory = NEIGHBOURS.remember(
            memory,
            40 * step,
            [("r2", measurement("r2", value))] if kind == "sample" else [],
            [("r2", plan("r2", value))] if kind == "plan" else [],
        )
    peer = of(memory, step)

    usable = [s for s in steps if s < step]
    newest = max(usable, default=FIRST - 1)
    age = step - 1 - newest
    limits = (PLANNER.max_peer_age, PLANNER.max_peer_age + PLANNER.hold_steps)
    assert peer.status == (USABLE, SILENT, LOST)[sum(age > limit for limit in limits)]
    if peer.status != USABLE:
        return
    assert peer.step == (newest if usable else None)
    np.testing.assert_allclose(
        peer.du, expected_du(step, age) if usable else np.zeros((PLANNER.N, 12)), atol=1e-9
    )
    for place, tick in enumerate(window_ticks(step)):
        planned = [s for s in usable if 40 * s < tick <= 40 * s + 10 * PLANNER.N]
        if tick in ticks:
            expected = mark("r2", tick)
        elif planned:
            expected = told(max(planned), (tick - 40 * max(planned)) // 10 - 1)
        else:
            assert not peer.known[place]
            assert not peer.du_ini[place].any()
            continue
        assert peer.known[place]
        assert peer.y_ini[place, 0] == pytest.approx(expected)
        np.testing.assert_allclose(peer.du_ini[place], expected, atol=1e-9)


def test_brought_forward_the_window_ends_now_and_its_end_is_what_the_peer_planned() -> None:
    memory = remember(20, [18, 19, 20], list(range(10, 810, 10)))
    peer = NEIGHBOURS.select(memory, 19, FIRST, 20)[0]
    assert (peer.status, peer.step, peer.age) == (USABLE, 19, 0)
    # Samples after the step that may be looked at come from its plan, measured or not.
    expected = [mark("r2", 750), mark("r2", 760), *(told(19, k) for k in range(4))]
    np.testing.assert_allclose(peer.y_ini[:, 0], expected)
    np.testing.assert_allclose(peer.du_ini[:, 0], expected, atol=1e-9)
    ahead = np.zeros(PLANNER.N)
    ahead[: PLANNER.N - 4] = told(19, np.arange(4, PLANNER.N))
    np.testing.assert_allclose(peer.du[:, 0], ahead, atol=1e-9)


def test_of_one_step_the_last_exchange_counts_whatever_the_order() -> None:
    first, second = plan("r2", 19), plan("r2", 19, exchange=1)
    second = replace(second, u=second.u + 7.0)
    for order in ([first, second], [second, first]):
        memory = remember(19, [18], window_ticks(20))
        memory = NEIGHBOURS.remember(memory, 800, [], [("r2", item) for item in order])
        peer = of(memory, 20)
        np.testing.assert_allclose(peer.du, expected_du(20, 0) + 7.0, atol=1e-9)
    again = NEIGHBOURS.remember(memory, 800, [], [("r2", second)])
    assert again.refused == memory.refused + 1


def test_complete_means_every_peer_s_plan_and_the_samples_before_it() -> None:
    memory = remember(19, [19], window_ticks(20))
    assert not NEIGHBOURS.is_complete(memory, (19, 0)), "r3 has said nothing"
    r3 = [("r3", measurement("r3", tick)) for tick in window_ticks(20)]
    both = NEIGHBOURS.remember(memory, 780, r3, [("r3", plan("r3", 19))])
    assert NEIGHBOURS.is_complete(both, (19, 0))
    assert not NEIGHBOURS.is_complete(both, (19, 1))
    assert not NEIGHBOURS.is_complete(both, (20, 0))
    without = NEIGHBOURS.remember(memory, 780, r3[:-1], [("r3", plan("r3", 19))])
    assert not NEIGHBOURS.is_complete(without, (19, 0))


def test_plans_of_before_a_stop_do_not_count() -> None:
    memory = remember(20, [12, 13], window_ticks(20))
    peer = NEIGHBOURS.select(memory, 19, 20, 19)[0]
    assert (peer.status, peer.step, peer.age) == (USABLE, None, 0)
    assert not peer.du.any()
