"""Every message of a key as arrays: against the messages themselves, one by one."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import quadriga
from quadriga.api import topic_reader
from quadriga.shared import messages as msg
from quadriga.shared.codec import decode
from quadriga.shared.errors import ConfigError, RecordingError
from quadriga.shared.recording.reader import Recording
from tests.quadriga.conftest import WriteRun, run_config

NOTHING = np.zeros(0)


def recorded(path: Path, key: str, kind: type[msg.Message]) -> list[msg.Message]:
    return [decode(entry.payload, kind) for entry in Recording(path).entries(keys={key})]


@pytest.mark.parametrize(
    ("key", "kind", "shape"),
    [
        ("r1/state", msg.State, (6001, 50)),
        ("r2/command", msg.Command, (6000, 60)),
        ("r1/measurement", msg.Measurement, (600, 22)),
        ("sim/truth", msg.Truth, (601, 2 * (3 + 4 + 3 + 3 + 12) + 2)),
        ("reference", msg.Reference, (61, 4)),
    ],
)
def test_arrays_hold_what_the_messages_hold(
    known_run: Path, key: str, kind: type[msg.Message], shape: tuple[int, int]
) -> None:
    run = quadriga.open(known_run)
    arrays, messages = run[key], recorded(run.path, f"team/{key}", kind)
    assert arrays.shape == shape
    assert (len(arrays), run.topics[key]) == (shape[0], shape[0])
    assert arrays.tick.tolist() == [message.tick for message in messages]
    assert arrays.time[-1] == messages[-1].tick / 1000
    for name in arrays:
        expected = [getattr(message, name) for message in messages]
        if name != "robots":  # texts
            np.testing.assert_array_equal(arrays[name], np.array(expected), err_msg=name)


def test_units_frames_and_names_are_those_of_the_wire(known_run: Path) -> None:
    state, truth = (quadriga.open(known_run)[key] for key in ("r1/state", "sim/truth"))
    gyro = state.fields["imu_gyro"]
    assert (gyro.shape, gyro.unit, gyro.frame) == ((3,), "rad/s", "trunk")
    assert gyro.numbers == ("imu_gyro.x", "imu_gyro.y", "imu_gyro.z")
    assert truth.fields["base_pos"].shape == ("n", 3)
    assert quadriga.open(known_run)["reference"].fields["vx"].unit == "m/s"
    np.testing.assert_array_equal(state["q"], state["q_joint"])
    np.testing.assert_array_equal(state["q_joint.FR_hip"], state["q_joint"][:, 3])
    np.testing.assert_array_equal(truth["r2.base_pos.y"], truth["base_pos"][:, 1, 1])
    np.testing.assert_array_equal(truth["r2.grf.RL.z"], truth["grf"][:, 1, 2, 2])


def status(tick: int, ages: dict[str, float], planner_ms: list[float]) -> msg.Status:
    times = np.array(planner_ms)
    return msg.Status(tick, 0, "walk", "", "kalman", ages, {"late": tick}, times, NOTHING)


def test_what_differs_in_length_is_padded_and_maps_have_a_column_for_each_name(
    write_run: WriteRun,
) -> None:
    extra = [
        ("team/r2/status", status(600, {"state": 1.0}, [0.5, 0.25])),
        ("team/r2/status", status(700, {"plan.r1": 40.0}, [1.0])),
    ]

    def change(key: str, message: msg.Message) -> msg.Message | None:
        return None if key == "team/r2/status" and message.tick < 600 else message

    run = quadriga.open(write_run(run_config(2, 0.5), extra=extra, change=change))
    assert run.topics["r2/status"] == 2
    arrays = run["r2/status"]
    np.testing.assert_array_equal(arrays["planner_ms"], [[0.5, 0.25], [1.0, np.nan]])
    np.testing.assert_array_equal(arrays["ages_ms"], [[np.nan, 1.0], [40.0, np.nan]])
    np.testing.assert_array_equal(arrays["ages_ms.state"], [1.0, np.nan])
    assert arrays.fields["ages_ms"].numbers == ("ages_ms.plan_r1", "ages_ms.state")
    assert arrays["mode"].tolist() == ["walk", "walk"]
    assert arrays["counters.late"].tolist() == [600.0, 700.0]
    assert arrays["tick_us"].shape == (2, 0)


def test_plans_of_several_horizons_stand_in_one_array(write_run: WriteRun) -> None:
    short = msg.Plan(480, 0, 12, np.ones((3, 12)), np.ones((3, 6)), "solved", {"r2": 11}, 0)
    run = quadriga.open(write_run(run_config(2, 0.5), extra=[("team/r1/plan", short)]))
    plans = run["r1/plan"]
    assert plans["u"].shape == (len(plans), 25, 12)
    assert plans["u.FL.x"].shape == (len(plans), 25)
    np.testing.assert_array_equal(plans["u"][-1, :3], np.ones((3, 12)))
    assert np.isnan(plans["u"][-1, 3:]).all()
    assert not np.isnan(plans["u"][:-1]).any()


def test_what_is_no_message_is_left_out_and_counted(write_run: WriteRun) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | bytes:
        if message.tick == 70 and key == "team/r1/state":
            return b"no state"
        if isinstance(message, msg.Truth) and message.tick == 50:
            return replace(
                message,
                base_pos=np.zeros((3, 3)),
                base_quat_wxyz=np.zeros((3, 4)),
                base_vel=np.zeros((3, 3)),
                base_omega=np.zeros((3, 3)),
                grf=np.zeros((3, 4, 3)),
            )  # of three robots
        return message

    run = quadriga.open(write_run(run_config(2, 0.5), change=change))
    assert (run["r1/state"].invalid, run["r1/state"].shape) == (1, (500, 50))
    assert (run["sim/truth"].invalid, len(run["sim/truth"])) == (1, 50)
    assert 50 not in run["sim/truth"].tick


def test_nothing_else_of_a_recording_is_decoded(
    known_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kinds: list[type[msg.Message]] = []

    def counted(payload: bytes, kind: type[msg.Message]) -> msg.Message:
        kinds.append(kind)
        return decode(payload, kind)

    monkeypatch.setattr(topic_reader, "decode", counted)
    run = quadriga.open(known_run)
    assert run.topics
    assert not kinds
    first = run["r1/measurement"]
    assert kinds == [msg.Measurement] * 600
    assert run["r1/measurement"] is first
    assert len(kinds) == 600


def test_a_key_or_a_field_that_there_is_not_is_named(known_run: Path) -> None:
    run = quadriga.open(known_run)
    with pytest.raises(RecordingError, match=r"'r1/stat'.*did you mean 'r1/state'"):
        run["r1/stat"]
    with pytest.raises(RecordingError, match="'r7/state'"):
        run["r7/state"]
    with pytest.raises(RecordingError, match=r"'q_joint.FL_hop'.*did you mean 'q_joint.FL_hip'"):
        run["r1/state"]["q_joint.FL_hop"]
    assert run["r1/event"].shape == (0, 0)
    assert run["team/r1/state"].key == "r1/state"
    assert repr(run["r1/state"]).startswith("TopicArrays('r1/state', shape=(6001, 50), fields=q_")


def test_a_frame_has_a_row_for_each_message_or_sample(known_run: Path) -> None:
    pandas = pytest.importorskip("pandas")
    run = quadriga.open(known_run)
    state = run["r1/state"].frame()
    assert isinstance(state, pandas.DataFrame)
    assert (state.shape, state.index.name) == ((6001, 50), "tick")
    assert state["q_joint.FL_hip"].iloc[0] == run["r1/state"]["q_joint"][0, 0]
    plans = run["r1/plan"]
    frame = plans.frame()
    assert frame.index.names == ["tick", "sample"]
    assert len(frame) == 25 * len(plans)
    assert frame.loc[(plans.tick[0], 3), "y.vx"] == plans["y"][0, 3, 1]
    statuses = run["r1/status"].frame()
    assert list(statuses["planner_ms"].iloc[-1]) == [0.2, 0.3, 1.0]
    assert statuses["mode"].iloc[-1] == "walk"
    assert run.tracking("r1").frame().shape == (600, 24)


def test_without_pandas_a_frame_costs_one_clear_error(
    known_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ConfigError, match=r"no Python package pandas, expected the extra 'frame'"):
        quadriga.open(known_run)["reference"].frame()
