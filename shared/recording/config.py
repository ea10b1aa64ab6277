"""The configuration of a recorded run, from the recording's metadata."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from functools import lru_cache
from typing import Final

from quadriga.shared.config.load import build, flatten
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, RecordingError
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.registry import ROBOTS

_OTHER_VERSION: Final = "recorded by another version of quadriga: use that one"


def recorded_config(recording: Recording) -> Config:
    """The configuration of a recorded run.

    A recording holds every key, so that no default of today stands for one of then. A robot of a
    package that is not installed keeps its name: messages can be read without it, and whatever
    needs more of it raises ConfigError (`Config.robot`).

    Raises:
        RecordingError: the recording holds none, or one with keys or values that this version
            does not know, or of a planner that is not installed.
    """
    try:
        return _build(recording.metadata.get("config_json", ""))
    except ConfigError as error:
        raise RecordingError(
            f"configuration of {recording.path}",
            f"{error.name} = {error.got}",
            error.expected,
            error.cause if error.name == "planner.kind" else _OTHER_VERSION,
        ) from None
    except (ValueError, RecursionError):  # the latter for what nests too deeply
        got, expected = "metadata without a configuration", "config_json in the metadata"
        raise RecordingError(str(recording.path), got, expected) from None


@lru_cache(maxsize=8)  # every reader of a recording asks, and a configuration does not change
def _build(text: str) -> Config:
    sections = json.loads(text)
    if not isinstance(sections, dict):
        raise ValueError("no table of sections")
    keys = flatten(sections)
    for name in flatten(asdict(Config())):
        if name not in keys:
            raise ConfigError(name, "no value", "a value of every key")
    team, robot = sections.get("team"), keys.get("team.robot")
    if isinstance(team, dict) and isinstance(robot, str) and robot not in ROBOTS:
        config = build({**sections, "team": {k: v for k, v in team.items() if k != "robot"}})
        return replace(config, team=replace(config.team, robot=printable_line(robot)))
    return build(sections)
