"""Every figure of the summary against a run whose figures are known in closed form."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from quadriga.recordings.summary import summarise
from quadriga.recordings.summary_table import print_summary
from quadriga.recordings.traces import ERRORS
from quadriga.shared import messages as msg
from quadriga.shared.config.sections import Config, PlannerConfig
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import OUTPUTS
from tests.quadriga.conftest import ESTIMATOR_ERROR, SPEED, WriteRun, run_config

APPROX = 1e-9


def table(summary: dict[str, Any]) -> str:
    """What `print_summary` shows."""
    text = io.StringIO()
    print_summary(summary, Console(file=text, width=140))
    return text.getvalue()


def test_figures_of_a_known_run(known_run: Path) -> None:
    run = known_run
    summary = summarise(run)
    assert json.loads((run / "summary.json").read_text()) == summary

    assert summary["fell"] is False
    assert summary["fallen"] == []
    assert summary["duration"] == 6.0
    assert summary["steady_from"] == pytest.approx(2.3, abs=0.1)
    assert summary["distance"] == pytest.approx(6 * SPEED, rel=1e-9)
    assert summary["mean_vx"] == pytest.approx(SPEED, abs=APPROX)
    assert summary["mean_vy"] == pytest.approx(-0.02, abs=APPROX)
    assert summary["mean_wz"] == pytest.approx(0.0, abs=APPROX)
    assert summary["real_time_factor"] == pytest.approx(0.5)
    assert summary["yoke_drift_max"] == pytest.approx(0.0004, rel=1e-3)

    rmse = summary["rmse"]
    assert rmse["z"] == pytest.approx(0.004 / np.sqrt(2), rel=0.02)
    assert rmse["vx"] == pytest.approx(0.01, abs=APPROX)
    assert rmse["vy"] == pytest.approx(0.02, abs=APPROX)
    assert rmse["roll"] == pytest.approx(0.03 / np.sqrt(2), rel=0.1)
    assert rmse["pitch"] == pytest.approx(0.01 / np.sqrt(2), abs=APPROX)  # r1: 0, r2: 0.01
    assert rmse["wz"] == pytest.approx(0.0, abs=APPROX)
    assert summary["rmse_per_robot"]["r1"]["pitch"] == pytest.approx(0.0, abs=APPROX)
    assert summary["rmse_per_robot"]["r2"]["pitch"] == pytest.approx(0.01, abs=APPROX)
    assert summary["estimator"] == "kalman"
    expected = dict(zip(OUTPUTS, np.abs(ESTIMATOR_ERROR), strict=True))
    assert summary["estimator_rmse"] == pytest.approx(expected, abs=APPROX)

    assert summary["planner"] == "distributed"
    assert summary["planner_solves"] == 2 * 3 * 56
    assert summary["planner_ms_median"] == pytest.approx(0.3)
    assert summary["planner_ms_p99"] == pytest.approx(1.0)
    assert summary["tick_us_median"] == pytest.approx(55.0)
    assert summary["tick_us_p99"] == pytest.approx(60.0)
    assert summary["counters"] == {"r1": {"qp_fallback": 5}, "r2": {"qp_fallback": 5}}
    assert summary["stop_reasons"] == {}

    per_topic = summary["messages_per_topic"]
    assert per_topic["team/r1/state"] == 6001
    assert per_topic["team/r2/command"] == 6000
    assert per_topic["team/r2/plan"] == 140
    assert summary["messages"] == sum(per_topic.values())
    assert summary["gaps"] == 0
    assert summary["invalid"] == summary["repeated"] == 0
    assert summary["cut"] == ""

    config = run_config()
    assert (summary["robots"], summary["seed"], summary["mode"]) == (2, 7, "lockstep")
    assert summary["config_sha256"] == config_sha256(config)
    assert summary["predictor_sha256"] == "cd" * 32
    assert {"python", "mujoco", "eclipse-zenoh"} <= summary["versions"].keys()


def test_outputs_do_not_depend_on_the_heading(write_run: WriteRun) -> None:
    summary = summarise(write_run(run_config(2, 3.3), yaw=-2.5))
    assert summary["mean_vx"] == pytest.approx(SPEED, abs=APPROX)
    assert summary["rmse"]["vy"] == pytest.approx(0.02, abs=APPROX)
    assert summary["rmse_per_robot"]["r2"]["pitch"] == pytest.approx(0.01, abs=APPROX)


def test_a_roll_that_is_off_by_a_whole_turn_is_no_error(write_run: WriteRun) -> None:
    def change(key: str, message: msg.Message) -> msg.Message:
        if not isinstance(message, msg.Measurement):
            return message
        turned = message.y.copy()
        turned[OUTPUTS.index("roll")] += 2 * np.pi
        return replace(message, y=turned)

    summary = summarise(write_run(run_config(2, 3.3), change=change))
    assert summary["estimator_rmse"]["roll"] == pytest.approx(0.004, abs=APPROX)


def test_on_uneven_ground_the_estimated_height_is_compared_with_nothing(
    write_run: WriteRun,
) -> None:
    """The robots tell the height over what they feel, the truth that over the terrain."""
    config = run_config(2, 3.3)
    rough = replace(config, world=replace(config.world, terrain="boxes"))
    summary = summarise(write_run(rough))
    assert summary["estimator_rmse"]["z"] is None
    assert summary["estimator_rmse"]["vx"] == pytest.approx(ESTIMATOR_ERROR[1], abs=APPROX)
    measured = (0.004**2 / 2 + ESTIMATOR_ERROR[0] ** 2) ** 0.5
    assert summary["rmse"]["z-over-stance-feet"] == pytest.approx(measured, rel=0.05)
    assert "z –" in table(summary)


def test_every_lost_message_is_a_gap(write_run: WriteRun) -> None:
    lost = {
        ("team/r1/state", 17), ("team/r1/state", 18), ("team/r2/command", 0),
        ("team/r2/measurement", 400), ("team/r1/plan", 800), ("team/sim/truth", 0),
    }  # fmt: skip
    summary = summarise(
        write_run(run_config(2, 1.0), change=lambda k, m: None if (k, m.tick) in lost else m)
    )
    assert summary["gaps"] == len(lost)
    gaps = {key: count for key, count in summary["gaps_per_topic"].items() if count}
    assert gaps == {
        "team/r1/state": 2,
        "team/r2/command": 1,
        "team/r2/measurement": 1,
        "team/r1/plan": 1,
        "team/sim/truth": 1,
    }


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_a_late_agent_that_passes_over_a_tick_in_real_time_loses_nothing(
    write_run: WriteRun, mode: str
) -> None:
    config = run_config(2, 1.0)
    config = replace(config, world=replace(config.world, mode=mode))
    unanswered = {("team/r1/command", 41), ("team/r1/command", 42), ("team/r1/command", 50)}
    run = write_run(
        config,
        change=lambda k, m: None if (k, m.tick) in unanswered else m,
        extra=[("team/r1/inputs", msg.Consumed(43, 0, 0, 2, (), ()))],
    )
    expected = 1 if mode == "realtime" else 3
    assert summarise(run)["gaps_per_topic"]["team/r1/command"] == expected


def test_a_silent_robot_is_all_gaps(write_run: WriteRun) -> None:
    config = run_config(2, 1.0)
    run = write_run(config, change=lambda k, m: None if k == "team/r2/command" else m)
    assert summarise(run)["gaps_per_topic"]["team/r2/command"] == 1000


def test_without_a_planner_no_plans_are_missed(write_run: WriteRun) -> None:
    config = replace(run_config(2, 1.0), planner=PlannerConfig(kind="none"))

    def change(key: str, message: msg.Message) -> msg.Message | None:
        if isinstance(message, msg.Status):
            return replace(message, planner_ms=np.zeros(0))
        return None if isinstance(message, msg.Plan) else message

    summary = summarise(write_run(config, change=change))
    assert summary["gaps"] == 0
    assert summary["planner"] == "none"
    assert summary["planner_ms_median"] is None


def test_what_does_not_decode_is_counted_by_topic(write_run: WriteRun) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | bytes:
        if key == "team/r1/measurement" and message.tick in (500, 510):
            return b"\x00noise"
        if key == "team/sim/truth" and message.tick == 700:
            return replace(message, robots=("x1", "x2"))  # type: ignore[call-arg]
        return message

    summary = summarise(write_run(run_config(2, 1.0), change=change))
    assert summary["invalid_per_topic"] == {"team/r1/measurement": 2, "team/sim/truth": 1}
    assert summary["gaps_per_topic"]["team/r1/measurement"] == 2


def test_a_forged_tick_does_not_ask_for_years(write_run: WriteRun) -> None:
    forged = 1 << 60
    zero = np.zeros(12)
    state = msg.State(forged, forged, zero, zero, zero, zero[:4], zero[:3], zero[:3], zero[:4])
    plan = msg.Plan(forged, forged, 7, np.zeros((25, 12)), np.zeros((25, 6)), "solved", {}, 0)
    extra = [("team/r1/state", state), ("team/r2/plan", plan), ("team/r9/state", state)]
    summary = summarise(write_run(run_config(2, 1.0), extra=extra))
    assert summary["gaps"] == 0
    assert summary["duration"] == 1.0


def test_a_robot_that_stopped_lacks_no_plans(write_run: WriteRun) -> None:
    run = write_run(
        run_config(2, 1.0),
        change=lambda _, m: None if isinstance(m, msg.Plan) and m.tick > 600 else m,
    )
    assert summarise(run)["gaps"] == 0


def test_a_fall_is_seen_without_being_told(write_run: WriteRun) -> None:
    def change(_: str, message: msg.Message) -> msg.Message:
        if isinstance(message, msg.Truth) and message.tick > 800:
            pos = message.base_pos.copy()
            pos[1, 2] = 0.08
            return replace(message, base_pos=pos)
        return message

    summary = summarise(write_run(run_config(2, 1.0), change=change))
    assert summary["fell"] is True
    assert summary["fallen"] == ["r2"]


def test_a_fall_is_believed_when_told(write_run: WriteRun) -> None:
    fall = msg.Event(999, 999_000_000, "fall", "r1", "tilt 1.2 rad", "fall")
    stop = msg.Event(999, 999_000_000, "stop", "", "robots fell", "fallen")
    events = [("team/sim/event", event) for event in (fall, stop)]
    summary = summarise(write_run(run_config(2, 1.0), extra=events))
    assert summary["fell"] is True
    assert summary["fallen"] == ["r1"]
    assert (summary["end"], summary["end_code"]) == ("robots fell", "fallen")
    assert "robots fell" in table(summary)
    assert summary["events"][:1] == [
        {"tick": 999, "kind": "fall", "code": "fall", "robot": "r1", "detail": "tilt 1.2 rad"}
    ]


def test_why_a_robot_stopped_is_told(write_run: WriteRun) -> None:
    def change(key: str, message: msg.Message) -> msg.Message:
        if isinstance(message, msg.Status) and message.tick == 900 and key == "team/r1/status":
            return replace(message, mode="damping", reason="lost peer [r2]")
        return message

    summary = summarise(write_run(run_config(2, 1.0), change=change))
    assert summary["stop_reasons"] == {"r1": "lost peer [r2]"}
    assert "lost peer [r2]" in table(summary)


def test_a_walk_too_short_has_no_steady_part(write_run: WriteRun) -> None:
    summary = summarise(write_run(run_config(2, 1.0)))
    assert summary["mean_vx"] is None
    assert summary["rmse"] == dict.fromkeys(ERRORS)
    assert summary["estimator_rmse"] == dict.fromkeys(OUTPUTS)
    assert summary["distance"] == pytest.approx(SPEED, rel=1e-9)
    assert "vx –" in table(summary)


def test_a_cut_recording_is_summarised_up_to_the_cut(known_run: Path, tmp_path: Path) -> None:
    whole = (known_run / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(whole[: len(whole) * 3 // 4])
    summary = summarise(tmp_path)
    assert 3.0 < summary["duration"] < 5.0
    assert "ends at byte" in summary["cut"]
    assert summary["mean_vx"] == pytest.approx(SPEED, abs=APPROX)
    assert "ends at byte" in table(summary)


def test_a_missing_recording_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"run\.mcap"):
        summarise(tmp_path)


def test_the_table_tells_the_main_figures(known_run: Path) -> None:
    text = table(summarise(known_run))
    for part in (
        "3.06 m in 6.0 s",
        "qp_fallback 10",
        "vx +0.510",
        "z 2.8 mm",
        "kalman",
        "median 0.30 ms",
        "p99 1.00 ms",
        "0.50",
        "0 gaps",
        "none",
    ):
        assert part in text


def test_metadata_brings_the_configuration_back(write_run: WriteRun) -> None:
    config: Config = run_config(3, 0.5)
    recording = Recording(write_run(config) / "run.mcap")
    assert recorded_config(recording) == config
    assert recording.metadata["config_sha256"] == config_sha256(config)


def test_without_truth_a_fall_is_told_by_the_robot_and_no_figure_is_made_up(
    write_run: WriteRun,
) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | None:
        if isinstance(message, msg.Status) and key == "team/r2/status" and message.tick >= 500:
            return replace(message, mode="damping", reason="fall")
        return None if isinstance(message, msg.Truth) else message

    summary = summarise(write_run(run_config(2, 1.0), change=change))
    assert summary["fallen"] == ["r2"]
    text = table(summary)
    assert "without truth" in text
    assert "yoke drift" not in text
    assert "RMSE" not in text


def test_what_came_late_in_real_time(write_run: WriteRun) -> None:
    ages = {"r1.command.median": 0.0, "r1.command.p99": 2.0, "r1.command.max": 5.0}
    ages |= {"jitter.median": 0.02, "jitter.p99": 0.2, "jitter.max": 3.0}
    counters = {"ticks": 6000, "overruns": 4, "r1.late": 300, "r1.held": 7, "r2.late": 0}
    nothing = np.zeros(0)
    sim_status = msg.Status(6000, 0, "realtime", "", "", ages, counters, nothing, nothing)
    own = msg.Status(6001, 0, "walk", "", "kalman", {"jitter.max": 1.5}, {}, nothing, nothing)
    run = write_run(run_config(), extra=[("team/sim/status", sim_status), ("team/r1/status", own)])
    summary = summarise(run)
    late = summary["realtime"]
    assert late["world"]["overruns"] == 4
    assert late["world"]["jitter_ms"] == {"median": 0.02, "p99": 0.2, "max": 3.0}
    assert late["r1"]["late_share"] == pytest.approx(0.05)
    assert late["r1"]["held"] == 7
    assert late["r1"]["command_age_ms"] == {"median": 0.0, "p99": 2.0, "max": 5.0}
    assert late["r1"]["jitter_ms"] == {"max": 1.5}
    assert late["r2"]["late"] == 0
    assert "5.0 % of commands, 7 held;" in table(summary)


def test_in_lock_step_nothing_is_late(known_run: Path) -> None:
    assert summarise(known_run)["realtime"] is None
