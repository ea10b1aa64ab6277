"""`quadriga info`: what it says of a recording, whoever made it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from quadriga.recordings.metadata import build_metadata
from quadriga.shared import messages as msg
from quadriga.shared.codec import encode
from quadriga.shared.config.timing import periods
from quadriga.shared.recording.reader import Recording
from quadriga.shared.recording.writer import RecordingWriter
from tests.quadriga.commands.conftest import CONFIG, RunCommand
from tests.quadriga.conftest import write


def test_info_says_it_all(small: Path, run_command: RunCommand) -> None:
    status, lines, err = run_command("info", small)
    assert (status, err) == (0, "")
    text = "\n".join(lines)
    for line in (
        r"  file +0\.\d\d MB, whole",
        r"  world time +0\.600 s",
        r"  falls +r2",
        r"  end +fall of r2",
        r"  predictor +cdcdcdcdcdcdcdcd",
        r"  versions +python",
        r"  team +team, 2 × Unitree A1, lockstep, flat, seed 7",
        r"  team/r1/state +State +601 +1000\.0 +0 +600 +0",
        r"  team/r2/plan +Plan +5 +25\.0 +400 +560 +0",
        r"  world\.seed +7  \(default 0\)",
        r"  team\.robots +2  \(default 3\)",
        r"  0\.200 s  push +r1  80 N",
        r"  r1  walk +qp_fallback 0",
    ):
        assert re.search(f"^{line}", text, re.MULTILINE), line
    assert "reference.vx" not in text  # it is the default


def test_info_names_gaps_and_reasons_to_stop(tmp_path: Path, run_command: RunCommand) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | None:
        if isinstance(message, msg.Status) and message.tick == 500 and "r2" in key:
            return replace(message, mode="stopping", reason="peer-lost:r1")
        return None if key == "team/r1/command" and 100 <= message.tick < 110 else message

    _, lines, _ = run_command("info", write(tmp_path, CONFIG, change=change) / "run.mcap")
    text = "\n".join(lines)
    assert re.search(r"^  messages +[\d,]+, 10 lost$", text, re.MULTILINE)
    assert re.search(r"^  team/r1/command .* 10$", text, re.MULTILINE)
    assert re.search(r"^  r2 stopped +peer-lost:r1$", text, re.MULTILINE)


odd_versions = pytest.mark.parametrize(
    "versions",
    ["not JSON", "[1]", '{"python": "\x1b[31m3"}', "[" * 100_000],
    ids=["text", "list", "control", "nested"],
)


@odd_versions
def test_metadata_of_anybody_do_no_harm(
    tmp_path: Path, run_command: RunCommand, versions: str
) -> None:
    path = tmp_path / "odd.mcap"
    metadata = build_metadata(CONFIG, "") | {"versions": versions, "topics": versions}
    with RecordingWriter(path, metadata, 16, periods=periods(CONFIG)) as writer:
        writer.write(
            "team/sim/event", encode(msg.Event(200, 0, "stop", "", "\x1b[2J\nend", "time-over")), 0
        )
    status, lines, err = run_command("info", path)
    assert (status, err) == (0, "")
    assert "\x1b" not in "".join(lines)
    assert re.search(r"^  end +\ufffd\[2J end$", "\n".join(lines), re.MULTILINE)


@odd_versions
def test_a_report_shows_metadata_of_anybody(
    tmp_path: Path, small: Path, run_command: RunCommand, versions: str
) -> None:
    path, source = tmp_path / "odd.mcap", Recording(small)
    metadata = dict(source.metadata) | {"versions": versions}
    with RecordingWriter(path, metadata, 16, periods=periods(CONFIG)) as writer:
        for entry in source.entries():
            writer.write(entry.key, entry.payload, entry.log_time_ns)
    status, lines, err = run_command("report", path, "--html", tmp_path / "odd.html")
    assert (status, err) == (1, "")  # it tells of a fall
    assert "\x1b" not in "".join(lines)


@pytest.mark.parametrize("text", ["[" * 100_000, "[]", "no JSON"], ids=["nested", "list", "text"])
def test_a_configuration_that_is_none_is_one_clear_error(
    tmp_path: Path, run_command: RunCommand, text: str
) -> None:
    path = tmp_path / "odd.mcap"
    with RecordingWriter(path, build_metadata(CONFIG, "") | {"config_json": text}) as writer:
        writer.write("team/r1/state", b"", 0)
    status, _, err = run_command("report", path)
    assert (status, err.count("\n")) == (2, 1)
    assert "odd.mcap: got metadata without a configuration" in err
