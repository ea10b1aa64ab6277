"""A recorded walk in a script: configuration, summary, events, tracking, predictor, replay."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import quadriga
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.recordings.summary import summarise
from quadriga.shared import codes
from quadriga.shared import messages as msg
from quadriga.shared.recording.reader import Recording
from tests.golden import scenario
from tests.quadriga.conftest import ESTIMATOR_ERROR, SPEED, WriteRun, run_config

FALL = msg.Event(400, 400_000_000, "fall", "r2", "tilt 1.10 rad", "fall")


def test_a_folder_and_its_recording_are_the_same_run(known_run: Path) -> None:
    for path in (known_run, str(known_run), known_run / "run.mcap"):
        run = quadriga.open(path)
        assert (run.folder, run.path, run.complete) == (known_run, known_run / "run.mcap", True)
        assert run.config == run_config()
        assert run.robots == ("r1", "r2")


def test_what_is_no_recording_is_one_error(tmp_path: Path) -> None:
    with pytest.raises(quadriga.RecordingError, match=r"run\.mcap: got No such file"):
        quadriga.open(tmp_path)
    (tmp_path / "run.mcap").write_bytes(b"something else")
    with pytest.raises(quadriga.QuadrigaError, match="do not start as MCAP"):
        quadriga.open(tmp_path)


def test_the_summary_is_what_the_walk_has_left_or_the_same_computed(write_run: WriteRun) -> None:
    folder = write_run(run_config(2, 2.6))
    computed = quadriga.open(folder).summary
    assert not (folder / "summary.json").exists()
    assert summarise(folder) == computed
    left = {**computed, "distance": 7.0}
    (folder / "summary.json").write_text(json.dumps(left), encoding="utf-8")
    assert quadriga.open(folder).summary == left
    for foreign in ({**left, "config_sha256": "ab"}, 3):
        (folder / "summary.json").write_text(json.dumps(foreign), encoding="utf-8")
        assert quadriga.open(folder).summary == computed


def test_topics_are_counted_by_the_index_and_without_one(known_run: Path, tmp_path: Path) -> None:
    whole = quadriga.open(known_run)
    counted = Counter(entry.key for entry in Recording(whole.path).entries())
    assert {f"team/{key}": count for key, count in whole.topics.items()} == counted
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.path.read_bytes()[: whole.path.stat().st_size // 2])
    run = quadriga.open(cut)
    assert not run.complete
    assert 0 < run.topics["r1/state"] == len(run["r1/state"]) < whole.topics["r1/state"]


def test_events_are_those_of_the_world_and_of_the_robots(
    write_run: WriteRun, known_run: Path
) -> None:
    halts = msg.Event.of(300, codes.HALTS, "r1", "stop:by hand")
    extra = [("team/sim/event", FALL), ("team/r1/event", halts), ("team/r9/event", FALL)]
    run = quadriga.open(write_run(run_config(2, 0.5), extra=extra))
    found = [(event.tick, event.robot, event.kind) for event in run.events]
    assert found == [(300, "r1", "fault"), (400, "r2", "fall")]
    assert quadriga.open(known_run).events == ()


def test_measured_commanded_planned_and_true_outputs_stand_on_one_grid(known_run: Path) -> None:
    tracking = quadriga.open(known_run).tracking("r2")
    assert tracking.tick.tolist() == list(range(0, 6000, 10))
    assert tracking.outputs == ("z", "vx", "vy", "roll", "pitch", "wz")
    late = tracking.time > 2.0
    np.testing.assert_allclose(tracking.commanded[late, 1], 0.5)
    np.testing.assert_allclose(tracking.truth[late, 1], SPEED, atol=1e-9)
    np.testing.assert_allclose(tracking.measured[late, 1], SPEED + ESTIMATOR_ERROR[1], atol=1e-9)
    np.testing.assert_allclose(tracking.planned[late, 1], SPEED, atol=1e-9)
    np.testing.assert_allclose(tracking.error[late, 1], 0.01 + ESTIMATOR_ERROR[1], atol=1e-9)
    assert np.isnan(tracking.planned[tracking.time < 0.4]).all(), "before the first plan"
    with pytest.raises(quadriga.RecordingError, match=r"'r3', expected one of r1, r2"):
        quadriga.open(known_run).tracking("r3")


def test_a_recorded_robot_is_computed_again_to_the_byte(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(scenario.RECORDING.read_bytes())
    (tmp_path / "predictor.npz").write_bytes(scenario.PREDICTOR.read_bytes())
    run = quadriga.open(tmp_path)
    result = run.replay("r2")
    # On a machine of another arithmetic the last bits are others, and it says where.
    assert result.equal == (result.difference is None)
    if result.equal:
        assert result.compared == {"command": 600, "measurement": 59, "plan": 12}
        assert "equal to the byte" in str(result)
    assert predictor_sha256(run.predictor()) == Recording(run.path).metadata["predictor_sha256"]
    with pytest.raises(quadriga.RecordingError, match="'r3'"):
        run.replay("r3")


def test_a_walk_without_a_predictor_has_none(write_run: WriteRun) -> None:
    with pytest.raises(quadriga.PredictorError, match="none in"):
        quadriga.open(write_run(run_config(2, 0.5))).predictor()


def test_a_replay_leaves_the_callers_threads_alone() -> None:
    with threadpool_limits(limits=2):
        before = [library["num_threads"] for library in threadpool_info()]
        with threadpool_limits(), threadpool_limits(limits=1):
            assert all(library["num_threads"] == 1 for library in threadpool_info())
        assert [library["num_threads"] for library in threadpool_info()] == before
