"""Pictures of recordings: of a run whose motions are known, and of the golden one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadriga.recordings.metadata import build_metadata
from quadriga.shared import messages as msg
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.writer import RecordingWriter
from quadriga.view.compose import compose
from quadriga.view.picture import Picture
from quadriga.view.readings import read_accounts, read_outputs
from quadriga.view.recorded import RecordedRun
from tests.golden.scenario import RECORDING
from tests.quadriga.conftest import ESTIMATOR_ERROR, SPEED, WriteRun, outputs, run_config

YAW = 0.3  # of the known run
TICK = 3010


@pytest.fixture(scope="module")
def run(known_run: Path) -> RecordedRun:
    return RecordedRun(Recording(known_run / "run.mcap"))


@pytest.fixture(scope="module")
def picture(run: RecordedRun) -> Picture:
    return compose(run.shape, run.snapshot(TICK))


def test_trunks_are_where_the_simulator_says(picture: Picture) -> None:
    assert picture.is_truth
    assert picture.tick == TICK
    heading = np.array([np.cos(YAW), np.sin(YAW)])
    assert picture.centre[:2] @ heading == pytest.approx(SPEED * TICK / 1000, abs=1e-9)
    assert picture.trunk[:, 2] == pytest.approx([outputs(TICK, i)[0] for i in range(2)])


def test_outputs_are_those_of_the_instant(run: RecordedRun) -> None:
    found = read_outputs(run.shape, run.snapshot(TICK))
    for i in range(2):
        true = outputs(TICK, i)
        assert found.true[i] == pytest.approx(true, abs=1e-6)
        assert found.measured[i] == pytest.approx(true + ESTIMATOR_ERROR)
        # The plan in force begins at 3000; its second sample is for 3020.
        assert found.planned[i] == pytest.approx(outputs(TICK + 10, i))
    assert found.asked == pytest.approx([0.26, 0.5, 0.0, 0.0, 0.0, 0.0], abs=0.05)


def test_paths_go_as_far_as_what_is_left_of_the_plan(picture: Picture) -> None:
    assert picture.paths.shape == (2, 26, 3)
    assert picture.paths[:, 0] == pytest.approx(picture.trunk[:, :3])
    left = 0.24  # s: 25 samples, of which one is over
    ahead = picture.paths[:, -1, :2] - picture.trunk[:, :2]
    heading = np.array([np.cos(YAW), np.sin(YAW)])
    assert ahead @ heading == pytest.approx(np.full(2, SPEED * left), abs=1e-3)
    assert (picture.paths[:, -1] == picture.paths[:, -2]).all()  # padded to the plan's length


def test_forces_are_in_the_world_frame(picture: Picture, run: RecordedRun) -> None:
    weight = run.shape.config.robot.weight
    assert picture.planned_forces.sum(axis=1)[:, 2] == pytest.approx([weight, weight])
    assert (picture.contact == (np.linalg.norm(picture.true_forces, axis=2) > 0.0)).all()
    assert picture.contact.any()
    assert not picture.contact.all()


def test_accounts_tell_mode_and_ages_of_peers_plans(run: RecordedRun) -> None:
    first = read_accounts(run.shape, run.snapshot(TICK))[0]
    assert (first.mode, first.reason, first.estimator) == ("walk", "", "kalman")
    assert (first.plan, first.plan_age_ms, first.planner_ms) == ("solved", 10, 1.0)
    assert first.peer_ages_ms == {"r2": 40}


def test_before_anything_was_recorded_the_team_stands_at_its_place(run: RecordedRun) -> None:
    before = compose(run.shape, run.snapshot(-1))
    assert not before.known.any()
    assert before.trunk == pytest.approx(run.shape.spawn)
    assert np.isnan(read_outputs(run.shape, run.snapshot(-1)).asked).all()
    assert before.contact.all()


def test_without_truth_robots_are_where_they_believe(write_run: WriteRun) -> None:
    folder = write_run(
        run_config(seconds=2.0),
        yaw=0.0,
        change=lambda key, message: None if key == "team/sim/truth" else message,
    )
    run = RecordedRun(Recording(folder / "run.mcap"))
    estimate = compose(run.shape, run.snapshot(1500))
    assert not estimate.is_truth
    assert estimate.known.all()
    assert not estimate.true_forces.any()
    # They measure speeds and a yaw rate that are wrong by what the run says.
    seconds = np.arange(10, 1501, 10) / 1000
    yaw = ESTIMATOR_ERROR[5] * (seconds - 0.005)
    vx, vy = SPEED + ESTIMATOR_ERROR[1], -0.02 + ESTIMATOR_ERROR[2]
    moved = 0.01 * np.array(
        [(vx * np.cos(yaw) - vy * np.sin(yaw)).sum(), (vx * np.sin(yaw) + vy * np.cos(yaw)).sum()]
    )
    assert estimate.trunk[:, :2] - run.shape.spawn[:, :2] == pytest.approx(
        np.tile(moved, (2, 1)), abs=1e-5
    )


def test_a_golden_walk_is_shown_by_its_own_account() -> None:
    run = RecordedRun(Recording(RECORDING))
    assert (run.first, run.last) == (0, 590)  # a state of each ten is kept
    assert [mark.tick for mark in run.marks] == [300]
    assert run.marks[0].text.startswith("push r2")
    picture = compose(run.shape, run.snapshot(run.last))
    assert not picture.is_truth
    moved = picture.centre - run.shape.spawn[:, :3].mean(axis=0)
    assert 0.02 < moved[0] < 0.4 * 0.6
    assert picture.link_positions[..., 2].min() > -0.05


def test_of_invalid_messages_the_one_before_counts(write_run: WriteRun) -> None:
    def spoil(key: str, message: msg.Message) -> msg.Message | bytes:
        spoilt = key == "team/sim/truth" and message.tick == 500
        return encode(message)[:-3] if spoilt else message

    folder = write_run(run_config(seconds=1.0), change=spoil)
    run = RecordedRun(Recording(folder / "run.mcap"))
    truth = run.snapshot(500).truth
    assert truth is not None
    assert truth.tick == 490


def test_a_recording_of_no_robot_is_refused(tmp_path: Path) -> None:
    config = load(None, {})
    with RecordingWriter(tmp_path / "run.mcap", build_metadata(config, "")) as writer:
        writer.write("team/reference", encode(msg.Reference(0, 0, 0.5, 0.0, 0.0, 0.26)), 1)
    with pytest.raises(RecordingError, match="neither states nor sim/truth"):
        RecordedRun(Recording(tmp_path / "run.mcap"))
