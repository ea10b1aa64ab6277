"""The configuration of a recorded run, from the recording's metadata."""

from __future__ import annotations

import json
from functools import lru_cache

from quadriga.shared.config.later import with_older_values
from quadriga.shared.config.load import build
from quadriga.shared.config.renamed import with_current_names
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, RecordingError
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.salvage import Salvage


def recorded_config(recording: Recording | Salvage) -> Config:
    """The configuration of a recorded run.

    What its version did not know yet is as it was then, see `with_older_values`.

    Raises:
        RecordingError: the recording holds none, or one with keys or values that this version
            does not know.
    """
    try:
        return _build(recording.metadata.get("config_json", ""))
    except _NoConfigurationError:
        raise RecordingError(
            str(recording.path), "metadata without a configuration", "config_json in the metadata"
        ) from None
    except ConfigError as error:
        raise RecordingError(
            f"configuration of {recording.path}",
            f"{error.name} = {error.got}",
            error.expected,
            error.cause
            if error.name == "planner.kind"
            else "recorded by another version of quadriga: use that one",
        ) from None
    except RecursionError:  # in the words about a value that nests as deeply as JSON permits
        raise RecordingError(
            f"configuration of {recording.path}",
            "values nested in values",
            "sections of keys",
            "recorded by something else than quadriga",
        ) from None


class _NoConfigurationError(Exception):
    """The text is no table of sections."""


@lru_cache(maxsize=8)  # every reader of a recording asks, and a configuration does not change
def _build(text: str) -> Config:
    try:
        sections = json.loads(text)
    except (ValueError, RecursionError):  # the latter for what nests too deeply
        raise _NoConfigurationError from None
    if not isinstance(sections, dict):
        raise _NoConfigurationError
    return build(with_older_values(with_current_names(sections)))
