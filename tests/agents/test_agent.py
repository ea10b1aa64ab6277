"""The agent as a function: what it sends when, that it is pure, and within its limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadriga.agents.agent import Agent
from quadriga.agents.gait import scheduled_stance
from quadriga.agents.planning.interface import Expected
from quadriga.identification.rollout import Rollout
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import Array
from tests.a1 import TORQUE_LIMIT, nominal_forces
from tests.agents.duet import (
    CONFIG,
    FIRST_PLAN,
    Step,
    every_100_ms,
    fingerprint,
    record,
    simple_predictor,
)
from tests.agents.lone_robot import ALONE, Robot, sent

Recorded = dict[str, list[Step]]
OBSERVER = Agent(CONFIG, "r1", simple_predictor(CONFIG))


@pytest.fixture(scope="module")
def duet() -> Recorded:
    """Two robots, planner on, 0.7 s."""
    return record(Rollout(CONFIG, simple_predictor(CONFIG), every_100_ms), 700)


@pytest.mark.parametrize("name", ["r1", "r2"])
def test_equal_inputs_give_equal_bytes_and_nothing_is_changed(duet: Recorded, name: str) -> None:
    """A recorded agent, run again from its inputs, sends the same bytes."""
    agent = Agent(CONFIG, name, simple_predictor(CONFIG))
    state = agent.initial()
    for step in duet[name]:
        state, outputs = agent.step(state, step.inputs)
        assert sent(outputs) == sent(step.outputs)
        assert (outputs.mode, outputs.counters) == (step.outputs.mode, step.outputs.counters)
        if step.inputs.state.tick % 20 == 0:
            before = fingerprint(step.before), fingerprint(step.inputs)
            agent.step(step.before, step.inputs)
            assert (fingerprint(step.before), fingerprint(step.inputs)) == before
    for place in (690, 400, 360, 680, 0, 320, 299):  # in any order, after another life
        _, outputs = agent.step(duet[name][place].before, duet[name][place].inputs)
        assert sent(outputs) == sent(duet[name][place].outputs)


def test_commands_are_torques_of_this_tick_alone_and_a_sample_ends_every_ten(
    duet: Recorded,
) -> None:
    for step in duet["r1"]:
        tick, command, sample = (
            step.inputs.state.tick,
            step.outputs.command,
            step.outputs.measurement,
        )
        assert (command.tick, command.stamp_ns) == (tick, tick * 1_000_000)
        assert 0.0 < np.abs(command.tau).max() <= TORQUE_LIMIT
        for array in (command.kp, command.kd, command.q_des, command.v_des):
            assert not array.any()
        assert (sample is not None) == (tick % 10 == 0 and tick > 0)
        assert sample is None or (sample.tick, sample.stamp_ns) == (tick, tick * 1_000_000)


@pytest.mark.parametrize("name", ["r1", "r2"])
def test_measured_forces_are_those_planned_for_the_sample(duet: Recorded, name: str) -> None:
    """Nominal forces before the first plan; then the samples of the newest plan."""
    index, plan = int(name[1]) - 1, None
    deviates = False
    for step in duet[name]:
        tick, measurement = step.inputs.state.tick, step.outputs.measurement
        if measurement is not None:
            stance = scheduled_stance(CONFIG, index, np.array([tick - 10]))[0]
            expected = nominal_forces(stance)
            if plan is not None:
                expected = plan.u[(tick - 10 - plan.tick) // 10]
                deviates |= bool(np.abs(expected - nominal_forces(stance)).max() > 1.0)
            np.testing.assert_allclose(measurement.u, expected, atol=1e-9)
            np.testing.assert_array_equal(measurement.stance, stance)
        plan = step.outputs.plan or plan
    assert deviates


@pytest.mark.parametrize(
    ("preset", "first", "last", "most"),
    [
        ("ideal", 0, 600, [0.004, 0.06, 0.06, 0.01, 0.01, 0.15]),
        # Offsets of encoders and tilt. An error of 0.01 rad in roll and pitch is told from one of
        # 0.15 m/s² of the accelerometer by its share of 0.3 alone: three deviations are left.
        ("realistic", 1500, 2000, [0.012, 0.08, 0.08, 0.03 * 0.7**0.5, 0.03 * 0.7**0.5, 0.15]),
    ],
)
def test_measured_outputs_are_close_to_the_truth(
    preset: str, first: int, last: int, most: list[float]
) -> None:
    sensors = load(None, {"sensors.preset": preset}).sensors
    rollout = Rollout(replace(CONFIG, sensors=sensors), None, every_100_ms)
    for tick in rollout.ticks(last):
        if tick.tick < first:
            continue
        truth = rollout.world.truth()  # of the tick after
        for i, name in enumerate(rollout.world.names):
            measurement = tick.outputs[name].measurement
            if measurement is None:
                continue
            w, *xyz = truth.base_quat_wxyz[i]
            roll, pitch, yaw = pin.rpy.matrixToRpy(pin.Quaternion(w, *xyz).matrix())
            velocity = pin.utils.rotate("z", yaw).T @ truth.base_vel[i]
            expected = [truth.base_pos[i, 2], *velocity[:2], roll, pitch, truth.base_omega[i, 2]]
            error = np.abs(measurement.y - expected)
            assert (error < most).all(), tick.tick


def test_a_plan_is_sent_every_forty_ticks_and_uses_the_peers_last_one(duet: Recorded) -> None:
    for name, peer in (("r1", "r2"), ("r2", "r1")):
        for step in duet[name]:
            tick, plan = step.inputs.state.tick, step.outputs.plan
            assert (plan is not None) == (tick >= FIRST_PLAN and tick % 40 == 0)
            assert (step.outputs.planner_ns is None) == (plan is None)
            if plan is None:
                continue
            assert plan.tick == 40 * plan.step == tick
            assert plan.used == ({} if tick == FIRST_PLAN else {peer: plan.step - 1})
            assert plan.status == "solved"
            assert plan.u.shape == (CONFIG.planner.N, 12)
            assert step.outputs.ages_ms[f"plan.{peer}"] == 40.0


@pytest.mark.parametrize(
    ("tick", "expected"),
    [
        (0, Expected(reference_tick=0)),
        (301, Expected()),
        # Half a step after each planning step its plans, and the samples they were made of.
        (FIRST_PLAN - 20, Expected(None, FIRST_PLAN - 40, 300)),
        (FIRST_PLAN, Expected()),
        (340, Expected((8, 0), 320)),
        (380, Expected((9, 0), 360)),
        (400, Expected(reference_tick=400)),
    ],
)
def test_awaited_names_what_lock_step_must_have_received(tick: int, expected: Expected) -> None:
    assert Agent(CONFIG, "r1", simple_predictor(CONFIG)).expected(tick) == expected


def test_who_does_not_plan_awaits_references_and_the_truth_alone() -> None:
    assert Agent(CONFIG, "r1", None).expected(400) == Expected(reference_tick=400)
    truthful = replace(CONFIG, estimator=replace(CONFIG.estimator, kind="truth"))
    assert Agent(truthful, "r1", None).expected(401) == Expected(truth=True)


def test_excitation_is_added_on_the_stance_feet_while_walking() -> None:
    robot, noise = Robot(), np.arange(1.0, 13.0)
    for _ in range(521):
        outputs = robot.step(excitation=noise)
        if outputs.measurement is None:
            continue
        tick = outputs.measurement.tick
        stance = scheduled_stance(ALONE, 0, np.array([tick - 10]))[0]
        disturbance = noise * np.repeat(stance, 3) if tick > 300 else 0.0
        np.testing.assert_allclose(outputs.measurement.u, nominal_forces(stance) + disturbance)


@pytest.mark.parametrize(
    ("lost_samples", "back", "end"),
    [(0.03, 1000, ("walk", "")), (0.3, 1100, ("stand", "window-lost"))],
)
def test_gaps_in_the_ticks_are_bridged(
    lost_samples: float, back: int, end: tuple[str, str]
) -> None:
    """Real time: states get lost now and then; what falls on a lost tick is not sent later.

    With so many samples lost that no window is whole for long, the robot stops at last.
    """
    robot, random = Robot(planner=True), np.random.default_rng(0)
    lost = [0.3 if t % 10 else lost_samples for t in range(2000)]
    ticks = [t for t in range(2000) if random.random() > lost[t] or t % 40 == 0]
    ticks = [t for t in ticks if not 800 < t < back]
    for tick in ticks:
        robot.tick = tick
        outputs = robot.step()
        assert np.abs(outputs.command.tau).max() <= TORQUE_LIMIT
        stepped = not {*range(tick - 10, tick)}.isdisjoint(ticks)
        assert (outputs.measurement is not None) == (tick % 10 == 0 and stepped)
        assert outputs.plan is None or outputs.plan.tick == tick
    assert (outputs.mode, outputs.reason) == end
    assert np.abs(outputs.command.tau).max() > 1.0


@pytest.mark.parametrize(
    "passed", [[400], [410], range(398, 405), range(401, 410), range(395, 410), [403, 407, 408]]
)
def test_a_sample_is_of_its_own_ticks_whatever_was_passed_over(passed: Sequence[int]) -> None:
    """Deviation k N at the tick 400 + k."""
    robot = Robot()
    robot.run(390)
    samples = {}
    for tick in range(390, 431):
        if tick not in passed:
            robot.tick = tick
            excitation = np.tile([float(tick - 400), 0.0, 0.0], 4)
            samples[tick] = robot.step(excitation=excitation).measurement
    sample, counted = samples.get(410), [tick for tick in range(400, 410) if tick not in passed]
    if 410 in passed or not counted:
        assert sample is None
    else:
        assert sample is not None
        assert sample.u[::3].max() == pytest.approx(np.mean(counted) - 400)
    after = samples[420]
    assert after is not None
    first = 411 if 410 in passed else 410
    assert after.u[::3].max() == pytest.approx(np.mean(range(first, 420)) - 400)


def test_with_the_truth_the_outputs_are_the_truth_and_a_lost_one_is_bridged() -> None:
    config = replace(ALONE, estimator=replace(ALONE.estimator, kind="truth"))
    steps = record(Rollout(config, None, every_100_ms), 520)["r1"]
    agent = Agent(config, "r1", None)
    for step in steps[500:]:
        truth, measurement = step.inputs.truth, step.outputs.measurement
        assert truth is not None
        if measurement is None:
            continue
        w, *xyz = truth.base_quat_wxyz[0]
        yaw = pin.rpy.matrixToRpy(pin.Quaternion(w, *xyz).matrix())[2]
        velocity = pin.utils.rotate("z", yaw).T @ truth.base_vel[0]
        np.testing.assert_allclose(measurement.y[1:3], velocity[:2], atol=1e-9)
        assert measurement.y[5] == pytest.approx(truth.base_omega[0, 2], abs=1e-9)
        late = replace(truth, tick=truth.tick - 21)
        _, without = agent.step(step.before, replace(step.inputs, truth=late))
        _, without_any = agent.step(step.before, replace(step.inputs, truth=None))
        assert sent(without) == sent(without_any), "too old to be used"
        assert without.measurement is not None
        np.testing.assert_allclose(without.measurement.y[:3], measurement.y[:3], atol=0.02)


@given(
    st.integers(0, 699),
    arrays(np.float64, 12, elements=st.floats(-3.0, 3.0)),
    arrays(np.float64, 12, elements=st.floats(-30.0, 30.0)),
    arrays(np.float64, 4, elements=st.floats(0.05, 1.0)),
    arrays(np.float64, 6, elements=st.floats(-50.0, 50.0)),
    arrays(np.float64, 4, elements=st.floats(0.0, 500.0)),
)
@settings(deadline=None, max_examples=60)
def test_whatever_is_sensed_the_command_is_finite_and_within_the_limit(
    duet: Recorded, place: int, dq: Array, v: Array, quat: Array, imu: Array, force: Array
) -> None:
    """A wild state in the middle of a walk, and the tick after it."""
    step = duet["r1"][place]
    wild = replace(
        step.inputs.state,
        q_joint=step.inputs.state.q_joint + dq,
        v_joint=v,
        imu_quat_wxyz=quat,
        imu_gyro=imu[:3],
        imu_accel=imu[3:],
        foot_force=force,
    )
    agent, state = OBSERVER, step.before
    for tick in range(2):
        now = replace(wild, tick=wild.tick + tick)
        state, outputs = agent.step(state, replace(step.inputs, state=now))
        assert np.abs(outputs.command.tau).max() <= TORQUE_LIMIT
        decode(encode(outputs.command), type(outputs.command))
