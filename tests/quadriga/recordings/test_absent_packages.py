"""Recordings of planners and robots whose package is not installed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.api.run import Run
from quadriga.export.csv_files import write_csv
from quadriga.export.source import Source
from quadriga.recordings.check import check
from quadriga.recordings.info import format_survey
from quadriga.recordings.survey import survey
from quadriga.shared import planner_kinds
from quadriga.shared.errors import ConfigError, RecordingError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.writer import RecordingWriter
from tests.plugins.kinds import install_kind
from tests.quadriga.conftest import run_config, write


@pytest.fixture
def walk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A short recording with a planner of a package that is then uninstalled."""
    config = run_config(2, 0.5)
    site = tmp_path / "site"
    site.mkdir()
    install_kind(site, monkeypatch, "acme", "'m:f', needs_predictor=False, options={'gain': 1.0}")
    config = replace(config, planner=replace(config.planner, kind="acme", options="gain=2"))
    write(tmp_path, config)
    monkeypatch.undo()
    planner_kinds._find_plugin.cache_clear()
    return tmp_path / "run.mcap"


def test_a_recording_of_an_absent_planner_says_what_to_install(walk: Path) -> None:
    """And what it holds is listed all the same, with the package and its version."""
    found = survey(walk)
    assert {t.count for key, t in found.tracks.items() if key.endswith("/state")} == {501}
    assert "quadriga-acme 1.2" in "\n".join(format_survey(found))
    assert "install the package that has it" in str(found.error)
    with pytest.raises(RecordingError, match=r"planner\.kind = 'acme'.*install the package"):
        check(walk)


def test_the_messages_of_an_absent_robot_are_read_and_it_is_named(
    walk: Path, tmp_path: Path
) -> None:
    metadata = Recording(walk).metadata
    given = json.loads(metadata["config_json"])
    given["team"]["robot"] = "spot"
    given["planner"] |= {"kind": "none", "options": ""}
    path = tmp_path / "spot.mcap"
    with RecordingWriter(path, metadata | {"config_json": json.dumps(given)}) as writer:
        for entry in Recording(walk).entries():
            writer.write(entry.key, entry.payload, entry.log_time_ns)
    found = survey(path)
    assert found.error is None
    assert "2 × spot (a robot that is not installed here)" in "\n".join(format_survey(found))
    (torques,) = (finding for finding in check(path) if finding.name == "torques")
    assert (torques.passed, torques.looked > 500) == (True, True)
    assert "limits of 'spot' are not known here" in torques.notes
    assert Run(path)["r1/state"].tick.tolist() == list(range(501))
    assert len(write_csv(Source(Recording(path)), tmp_path / "csv", lambda _: None)) > 5
    with pytest.raises(ConfigError, match=r"team\.robot: got 'spot'.*install what brings"):
        _ = recorded_config(Recording(path)).robot
