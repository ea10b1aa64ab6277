"""The configuration of a recording: all of it, and nothing but what this version knows."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording

CONFIG = load(None, {"controller.reflex_ms": 3, "team.robot": "go1"})


class Metadata:
    """As much of a recording as its configuration is read from."""

    path = Path("run.mcap")

    def __init__(self, sections: object) -> None:
        self.metadata = {"config_json": json.dumps(sections)}


def read(sections: dict[str, Any]) -> object:
    return recorded_config(cast(Recording, Metadata(sections)))


def test_what_was_written_is_read() -> None:
    assert read(asdict(CONFIG)) == CONFIG


@pytest.mark.parametrize(
    "change",
    [
        lambda sections: sections["world"].pop("friction"),
        lambda sections: sections.pop("motors"),
        lambda sections: sections["controller"].update(leashes=1),
    ],
    ids=["a key less", "a section less", "a key that there is not"],
)
def test_what_another_version_wrote_is_refused(change: Callable[[dict[str, Any]], None]) -> None:
    sections = asdict(CONFIG)
    change(sections)
    with pytest.raises(RecordingError) as caught:
        read(sections)
    assert "another version" in caught.value.cause
