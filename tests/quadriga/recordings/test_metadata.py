"""Versions that a recording names are compared with those that are installed."""

from __future__ import annotations

import json

from quadriga.recordings.metadata import (
    build_metadata,
    differing_versions,
    installed_versions,
    recorded_versions,
)
from quadriga.shared.config.sections import Config


def test_a_recording_made_now_differs_in_nothing() -> None:
    metadata = build_metadata(Config(), "ab")
    assert recorded_versions(metadata) == installed_versions()
    assert differing_versions(metadata) == ""


def test_other_and_absent_packages_are_named() -> None:
    recorded = installed_versions() | {"numpy": "0.1", "gone": "2"}
    text = differing_versions({"versions": json.dumps(recorded)})
    assert text == f"numpy 0.1 (here {installed_versions()['numpy']}), gone 2 (here absent)"
