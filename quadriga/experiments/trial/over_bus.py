"""A trial as processes of its own over the bus, and the walk that a recording holds."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.experiments.trial.figures_of_merit import Walk
from quadriga.recordings.summary import RECORDING
from quadriga.recordings.traces import read_traces
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError, RecordingError
from quadriga.shared.messages import Measurement
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import EVENT, MEASUREMENT, PLAN, REFERENCE, STATUS, TRUTH
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table
from quadriga.team.run_folder import make_run_dir

FAILED: Final = "controller-failed"  # begins the reason of a stop
_NEEDED: Final = {topic.name for topic in (TRUTH, REFERENCE, MEASUREMENT, PLAN, STATUS, EVENT)}


def walk_over_bus(config: Config, run_dir: Path, predictor: Path | None, sha256: str) -> Walk:
    """Walk as processes of their own, as `quadriga walk` does, and read what they recorded.

    Args:
        config: the team's configuration.
        run_dir: a new folder for the recording and the processes' logs.
        predictor: its file; None without a planner.
        sha256: the predictor's digest, for the recording.

    Raises:
        ProcessError: a process failed or left too early; a controller of one's own before the team
            walked.
        RecordingError: nothing was recorded.
        ConfigError: the folder holds a recording.
    """
    bus = replace(config.bus, endpoint=free_endpoint())
    config = replace(config, bus=bus, recorder=replace(config.recorder, enabled=True))
    make_run_dir(run_dir, config)
    failed: ProcessError | None = None
    with Launch(process_table(config, run_dir, predictor, sha256), run_dir / "logs") as launch:
        try:
            launch.watch(lambda: False)
        except ProcessError as error:
            if not config.team.agent_command:
                raise
            failed = error
    return _read_failed(config, run_dir, failed) if failed else read_walk(run_dir / RECORDING)


def _read_failed(config: Config, run_dir: Path, failed: ProcessError) -> Walk:
    """The walk up to where a controller of one's own failed: by that it is judged.

    Raises:
        ProcessError: it was another process, or nothing had been walked yet.
    """
    robot = failed.name.removeprefix("process ")
    if robot not in robot_names(config.team.robots):
        raise failed
    try:
        walk = read_walk(run_dir / RECORDING)
    except RecordingError:
        raise failed from None
    if walk.traces.truth.tick.max(initial=0) < config.gait.stand_ms:
        raise failed
    return replace(walk, failed={robot: with_detail(FAILED, failed.got)})


def read_walk(path: Path) -> Walk:
    """The walk in a recording.

    Raises:
        RecordingError: there is none, or it is empty or foreign.
    """
    recording = Recording(path)
    traces = read_traces(recording, _NEEDED)
    samples = {r: tuple(recording.messages(Measurement, r)) for r in traces.robots}
    plans = Counter(plan.status for of_robot in traces.plans.values() for plan in of_robot)
    return Walk(traces, samples, plans)
