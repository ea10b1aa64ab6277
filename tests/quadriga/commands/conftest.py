"""A short recording, and what a command says of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from quadriga.commands.parser import main
from quadriga.recordings.metadata import build_metadata
from quadriga.shared import messages as msg
from quadriga.shared.codec import encode
from quadriga.shared.config.timing import periods
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.writer import RecordingWriter
from tests.quadriga.conftest import run_config, write

RunCommand = Callable[..., tuple[int, list[str], str]]
CONFIG = run_config(seconds=0.6)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 0.6 s in chunks of 16 KiB, with a push, a fall and a stop."""
    source = write(tmp_path_factory.mktemp("source"), CONFIG) / "run.mcap"
    path = tmp_path_factory.mktemp("small") / "run.mcap"
    about = build_metadata(CONFIG, "cd" * 32)
    with RecordingWriter(path, about, 16, periods=periods(CONFIG)) as writer:
        for entry in Recording(source).entries():
            writer.write(entry.key, entry.payload, entry.log_time_ns)
        for tick, kind, robot, detail, code in (
            (200, "push", "r1", "80 N", "push"),
            (500, "fall", "r2", "tilt 1.0 rad", "fall"),
            (600, "stop", "", "fall of r2", "fallen"),
        ):
            event = msg.Event(tick, tick * 1_000_000, kind, robot, detail, code)
            writer.write("team/sim/event", encode(event), entry.log_time_ns)
    return path


@pytest.fixture
def run_command(capsys: pytest.CaptureFixture[str]) -> RunCommand:
    """A function that runs a command: its exit status, lines on stdout, stderr."""

    def run(*arguments: object) -> tuple[int, list[str], str]:
        status = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return status, out.splitlines(), err

    return run
