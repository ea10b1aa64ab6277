"""The page of a run: everything that was recorded, and a word about what was not."""

from __future__ import annotations

import os
from base64 import b64encode
from collections.abc import Container, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.commands.parser import main
from quadriga.recordings.metadata import build_metadata
from quadriga.recordings.traces import MeasurementTrace
from quadriga.recordings.truth import TruthTrace
from quadriga.report.page import build_page, write_page
from quadriga.report.run import ReportedRun, read_run
from quadriga.shared import messages as msg
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.writer import RecordingWriter
from tests.quadriga.conftest import Packet, WriteRun, run_config
from tests.quadriga.report.outline import Outline

SECTIONS = [
    "run", "summary", "timeline", "trajectories", "reference", "paths", "estimator", "yokes",
    "forces", "gait", "times", "ages", "traffic",
]  # fmt: skip
MB = 1_000_000


def outline(folder: Path) -> Outline:
    return Outline(build_page(read_run(folder / "run.mcap")))


def fallen(tick: int, robot: str = "r2") -> Iterator[Packet]:
    """What is told of a fall."""
    head = (tick, tick * 1_000_000)
    yield "team/sim/event", msg.Event(*head, "fall", robot, "tilt 1.00 rad", "fall")
    nothing = np.zeros(0)
    yield (
        f"team/{robot}/status",
        msg.Status(*head, "damping", "fall", "kalman", {}, {}, nothing, nothing),
    )


def test_a_run_without_trouble_has_every_section_but_what_to_look_at(known_run: Path) -> None:
    page = build_page(read_run(known_run / "run.mcap"))
    found = Outline(page)
    assert found.sections == SECTIONS
    assert len(page.encode()) < 3 * MB
    assert "2 yoked robots on flat ground, seed 7" in found.text
    assert "world.seed 7 0" in found.text, "what is not at its default"
    assert "cdcdcdcdcdcd" in found.text, "the predictor"
    for name in ("z [m]", "roll [rad]", "wz [rad/s]", "stretch of the yokes [mm]"):
        assert name in found.drawn
    for robot in ("r1", "r2"):
        assert f"trajectories of {robot}" in found.figures
        assert f"{robot} front right [N]" in found.drawn
    assert {link[1:] for link in found.links if not link.startswith("#t=")} <= found.anchors
    assert found.paths > 100


def test_the_page_shows_the_clip_beside_the_recording(write_run: WriteRun) -> None:
    folder = write_run(run_config(1, 0.5))
    recording, clip = folder / "run.mcap", folder / "walk.webp"
    without = Outline(write_page(read_run(recording), folder / "a.html").read_text("utf-8"))
    assert not without.pictures
    assert "clip" not in without.sections
    clip.write_bytes(b"RIFFabcdWEBP")
    found = Outline(write_page(read_run(recording), folder / "a.html").read_text("utf-8"))
    assert found.pictures == [f"data:image/webp;base64,{b64encode(clip.read_bytes()).decode()}"]
    assert found.sections[2] == "clip"
    os.utime(clip, (1.0, 1.0))  # of a walk before this one
    stale = Outline(write_page(read_run(recording), folder / "a.html").read_text("utf-8"))
    assert not stale.pictures


@pytest.mark.parametrize(
    ("interface", "said"),
    [("feedforward", "handed on, as an acceleration"), ("force", "tracks planned")],
)
def test_why_planned_and_true_forces_differ_is_said(
    write_run: WriteRun, interface: str, said: str
) -> None:
    config = run_config(1, 0.6)
    config = replace(config, planner=replace(config.planner, interface=interface))
    assert said in outline(write_run(config)).text


def test_a_page_is_small_however_many_robots_walk_however_long(write_run: WriteRun) -> None:
    run = read_run(write_run(run_config(10, 0.5), change=_Without(msg.Command)) / "run.mcap")
    page = build_page(_long(run, 20_000))
    assert len(page.encode()) < 3 * MB
    assert "trajectories of r10" in Outline(page).figures


def _long(run: ReportedRun, samples: int) -> ReportedRun:
    """The same run with noise, which cannot be thinned out, for truth and measurements."""
    noise, truth = np.random.default_rng(1), run.traces.truth
    tick = 10 * np.arange(samples)
    arrays: dict[str, Any] = {
        item.name: noise.standard_normal((samples, *getattr(truth, item.name).shape[1:]))
        for item in fields(truth)
    }
    y = noise.standard_normal((samples, 6))
    traces = replace(
        run.traces,
        truth=TruthTrace(**arrays | {"tick": tick}),
        measurements=dict.fromkeys(run.traces.robots, MeasurementTrace(tick, y)),
    )
    return replace(run, traces=traces, end=10 * samples)


def test_a_fall_is_marked_explained_and_linked(write_run: WriteRun) -> None:
    found = outline(write_run(run_config(2, 1.5), extra=fallen(1344)))
    assert found.sections[2] == "look"
    assert "Fell: r2 at 1.34 s" in found.text
    assert "the second before 1.344 s" in found.figures
    assert "#t=1.344" in found.links
    assert found.drawn.count("r2 fell") > 10


def test_links_lead_to_a_time_in_every_figure(known_run: Path) -> None:
    page = build_page(read_run(known_run / "run.mcap"))
    assert page.count('class="time"') == page.count("data-panels=") > 8
    assert "hashchange" in page


class _Without:
    """Loses all messages of some types."""

    def __init__(self, *lost: type[msg.Message]) -> None:
        self._lost = lost

    def __call__(self, _key: str, message: msg.Message) -> msg.Message | None:
        return None if isinstance(message, self._lost) else message


@pytest.mark.parametrize(
    ("lost", "left_out", "message"),
    [
        ((msg.Truth, msg.Event), {"paths", "estimator", "yokes"}, "No sim/truth, as of real"),
        ((msg.Plan,), set(), "No plan: planned curves"),
        ((msg.Status,), set(), "No status: modes"),
        ((msg.State,), {"gait"}, "No state: tilt"),
        ((msg.Measurement,), {"estimator"}, "No measurement: the agents'"),
        ((msg.Reference,), set(), "No reference: what was asked for"),
        ((msg.Status, msg.Plan), {"times", "ages"}, "No plan"),
        (
            (msg.Truth, msg.Plan, msg.Status, msg.Measurement, msg.State, msg.Reference),
            {
                "trajectories",
                "paths",
                "estimator",
                "yokes",
                "forces",
                "gait",
                "times",
                "ages",
                "reference",
            },
            "No state",
        ),
    ],
)
def test_what_is_absent_is_left_out_and_said_so(
    write_run: WriteRun, lost: tuple[type[msg.Message], ...], left_out: Container[str], message: str
) -> None:
    found = outline(write_run(run_config(2, 1.0), change=_Without(*lost)))
    assert found.sections == [name for name in SECTIONS if name not in left_out]
    assert message in found.text


def test_without_truth_the_agents_estimates_and_the_foot_sensors_are_shown(
    write_run: WriteRun,
) -> None:
    own_word = list(fallen(900))[1:]
    found = outline(write_run(run_config(2, 1.0), change=_Without(msg.Truth), extra=own_word))
    assert "Fell: r2 at 0.90 s" in found.text
    assert "r2 fell" in found.drawn
    assert "contact by the foot sensor" in found.text
    assert "measured (truth)" not in found.text
    assert "Each robot's estimated output" in found.text
    assert found.sections[2] == "look"


def test_a_gap_a_late_start_and_a_cut_are_told(write_run: WriteRun) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | None:
        lost = key == "team/r2/state" and 600 <= message.tick < 750
        return None if lost or message.tick < 300 else message

    folder = write_run(run_config(2, 1.2), change=change)
    path = folder / "run.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 9 // 10])
    found = outline(folder)
    assert "The recording begins at 0.30 s." in found.text
    assert "The recording is cut:" in found.text
    assert "150 messages of r2/state are missing" in found.text
    assert "no end was recorded" in found.text


def test_one_robot_alone_and_a_team_with_nothing_but_states(write_run: WriteRun) -> None:
    others = (msg.Truth, msg.Plan, msg.Status, msg.Measurement, msg.Command, msg.Reference)
    found = outline(write_run(run_config(1, 0.5), change=_Without(*others)))
    assert "1 robot on flat ground" in found.text
    assert found.sections == ["run", "summary", "timeline", "forces", "gait", "traffic"]


def test_what_is_not_a_message_does_no_harm(write_run: WriteRun) -> None:
    forged = 1 << 41
    short = np.zeros((1, 12)), np.zeros((1, 6))
    odd: list[Packet] = [
        ("team/r1/plan", msg.Plan(640, 0, 16, *short, "<b>&", {"r9": 3}, 0)),
        ("team/sim/event", msg.Event(700, 0, "fault", "r9", "<script>alert(1)</script>", "")),
        ("team/r1/measurement", msg.Measurement(
            forged, 0, np.zeros(12), np.full(6, 1e30), np.ones(4))),
        ("team/r1/measurement", msg.Measurement(330, 0, np.zeros(12), np.zeros(6), np.ones(4))),
    ]  # fmt: skip

    def change(key: str, message: msg.Message) -> msg.Message | bytes:
        return b"\xc1noise" if key == "team/r1/state" and message.tick % 7 == 0 else message

    nothing, empty = np.zeros(0), (np.zeros((0, 12)), np.zeros((0, 6)))
    mode = 'x"/></svg><script>alert(2)</script>'
    odd += [
        ("team/r2/status", msg.Status(710, 0, mode, "", "kalman", {}, {}, nothing, nothing)),
        ("team/r1/plan", msg.Plan(680, 0, 17, *empty, "solved", {}, 0)),
    ]
    folder = write_run(run_config(2, 0.8), change=change, extra=odd)
    page = build_page(read_run(folder / "run.mcap"))
    assert "<script>alert" not in page
    assert "nan %" not in page
    found = Outline(page)
    assert "<script>alert(1)</script>" in found.text, "as text"
    assert "trajectories of r1" in found.figures


def test_a_recording_from_elsewhere_is_a_page_beside_it(
    write_run: WriteRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_run(run_config(1, 0.6), change=_Without(msg.Truth))
    lab = (folder / "run.mcap").rename(tmp_path / "lab 3.mcap")
    assert main(["report", str(lab)]) == 0
    shown = capsys.readouterr().out
    assert "No sim/truth" in shown
    assert (tmp_path / "lab 3.html").is_file()
    assert main(["report", str(lab), "--html", str(tmp_path / "other.html")]) == 0
    assert (tmp_path / "other.html").read_bytes() == (tmp_path / "lab 3.html").read_bytes()
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".html", ".html", ".mcap"]


def test_a_page_is_never_written_over_a_recording(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_run(run_config(1, 0.5)) / "run.mcap"
    before = path.read_bytes()
    assert main(["report", str(path), "--html", str(path)]) == 2
    assert "expected a name that ends in .html" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_the_exit_status_tells_of_a_fall_in_a_file(write_run: WriteRun) -> None:
    folder = write_run(run_config(2, 0.8), extra=fallen(700))
    assert main(["report", str(folder / "run.mcap")]) == 1


@pytest.mark.parametrize("content", [b"", b"not a recording", None])
def test_no_recording_is_one_clear_error(
    content: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "odd.mcap"
    if content is not None:
        path.write_bytes(content)
    assert main(["report", str(path)]) == 2
    message = capsys.readouterr().err
    assert message.startswith("quadriga: ")
    assert "Traceback" not in message


def test_an_empty_recording_and_a_page_that_cannot_be_written_are_errors(
    write_run: WriteRun, tmp_path: Path
) -> None:
    RecordingWriter(tmp_path / "none.mcap", build_metadata(run_config(1, 0.5), "")).finish()
    with pytest.raises(RecordingError, match="without messages"):
        read_run(tmp_path / "none.mcap")
    run = read_run(write_run(run_config(1, 0.5)) / "run.mcap")
    with pytest.raises(RecordingError, match="a file that can be written"):
        write_page(run, tmp_path / "no" / "such" / "folder.html")
