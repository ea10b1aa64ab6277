"""A recording as far as it can be read, whether it is whole or damaged."""

from __future__ import annotations

from pathlib import Path

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.metadata import RECORDING
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.recover import DamagedRecording


def recording_of(path: Path) -> Path:
    """The recording that is named by its file or by its run folder."""
    return path / RECORDING if path.is_dir() else path


def open_readable(path: Path) -> tuple[Recording | DamagedRecording, RecordingError | None]:
    """A whole recording, or what is left of a damaged one and what is wrong with it.

    Raises:
        RecordingError: nothing of it can be read.
    """
    try:
        recording = Recording(path)
        recording.require_whole()
    except RecordingError as error:
        salvage = DamagedRecording(path)
        next(salvage.entries(), None)  # raises if a newer version wrote them
        return salvage, error
    next(recording.entries(), None)
    return recording, None


def config_or_default(source: Recording | DamagedRecording) -> Config:
    """The configuration of a recorded walk; the default if the file has lost it."""
    try:
        return recorded_config(source)
    except RecordingError:
        return Config()
