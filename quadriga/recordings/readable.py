"""A recording as far as it can be read, whether it is whole or damaged."""

from __future__ import annotations

from pathlib import Path

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.metadata import RECORDING
from quadriga.shared.recording.reader import Recording


def recording_of(path: Path) -> Path:
    """The recording that is named by its file or by its run folder."""
    return path / RECORDING if path.is_dir() else path


def open_readable(path: Path) -> tuple[Recording, RecordingError | None]:
    """A whole recording, or what is left of a damaged one and what is wrong with it.

    Raises:
        RecordingError: nothing of it can be read.
    """
    try:
        recording = Recording(path)
        recording.require_whole()
    except RecordingError as error:
        return Recording(path, salvage=True), error
    return recording, None


def config_or_default(source: Recording) -> Config:
    """The configuration of a recorded walk; the default if the file has lost it."""
    try:
        return recorded_config(source)
    except RecordingError:
        return Config()
