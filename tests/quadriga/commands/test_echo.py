"""`quadriga echo` of recordings."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from quadriga.recordings.metadata import build_metadata
from quadriga.shared import messages as msg
from quadriga.shared.codec import encode
from quadriga.shared.recording.writer import RecordingWriter
from tests.quadriga.commands.conftest import CONFIG, RunCommand
from tests.quadriga.conftest import write


def test_echo_is_one_readable_line_a_message(small: Path, run_command: RunCommand) -> None:
    _, lines, _ = run_command("echo", "r1/state", "--file", small, "-n", 3)
    assert len(lines) == 3
    assert lines[1].startswith("    0.001 s  team/r1/state  q_joint=[0 ")
    assert " … 12] v_joint=[0 0 0 0 … 12]" in lines[1]
    _, lines, _ = run_command("echo", "r2/plan", "--file", small, "-n", 1, "--full")
    assert "used={r1:9}" in lines[0]
    assert "u=[25×12:" in lines[0]
    assert "…" not in lines[0]
    assert len(re.findall(r"u=\[25×12:([^]]*)\]", lines[0])[0].split()) == 300
    _, lines, _ = run_command("echo", "sim/event", "--file", small)
    event_text = "kind='fall' robot='r2' detail='tilt 1.0 rad' code='fall'"
    assert lines[1] == f"    0.500 s  team/sim/event  {event_text}"


def test_echo_shows_what_is_no_message(tmp_path: Path, run_command: RunCommand) -> None:
    with RecordingWriter(tmp_path / "run.mcap", build_metadata(CONFIG, "")) as writer:
        writer.write("team/r1/state", b"\x01garbage", 5)
        writer.write("team/some/thing", b"\x00" * 100, 5)
    _, lines, _ = run_command("echo", "**", "--file", tmp_path / "run.mcap")
    assert "8 bytes, state is" in lines[0]
    assert "100 bytes, key is 'team/some/thing': 00 00" in lines[1]


def test_a_key_that_is_not_there_is_no_silence(small: Path, run_command: RunCommand) -> None:
    for options in ((), ("--rates",)):
        status, _, err = run_command("echo", *options, "r7", "r1/stat", "--file", small)
        assert (status, err.count("\n")) == (2, 1)
        assert "run.mcap: got no key that fits r7 r1/stat, expected some of team/r1/command" in err


def test_an_option_that_would_be_ignored_is_refused(small: Path, run_command: RunCommand) -> None:
    for options, message in (
        (("--every", "2", "**"), "--every: got no --rates beside it"),
        (("--rates", "--full"), "--full: got --rates beside it"),
        ((), "KEY: got none"),
        (("--rates", "-n", "-1"), "-n: got -1"),
    ):
        status, _, err = run_command("echo", "--file", small, *options)
        assert (status, err.count("\n")) == (2, 1)
        assert err.startswith(f"quadriga: {message}")


def test_a_run_folder_stands_for_its_recording(small: Path, run_command: RunCommand) -> None:
    assert run_command("info", small.parent) == run_command("info", small)
    assert run_command("echo", "plan", "--file", small.parent) == run_command(
        "echo", "plan", "--file", small
    )


def test_rates_are_those_of_keys_with_intervals_and_gaps(
    tmp_path: Path, run_command: RunCommand
) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | None:
        return None if key == "team/r1/state" and 100 <= message.tick < 105 else message

    run = write(tmp_path, CONFIG, change=change) / "run.mcap"
    _, lines, _ = run_command("echo", "--rates", "r1", "sim/truth", "--file", run)
    rows = {line.split()[0]: re.split(r"  +", line) for line in lines[1:]}
    assert rows["team/r1/state"][1:] == ["596", "991.7", "1 – 6", "495.8", "2.0 – 12.0", "5"]
    assert rows["team/sim/truth"][1:] == ["61", "100.0", "10 – 10", "50.0", "20.0 – 20.0", "0"]
    assert "team/r2/state" not in rows


@pytest.mark.parametrize(
    "words",
    [("echo", "**", "--file"), ("echo", "--rates", "--file"), ("info",), ("info", "--check")],
)
def test_nothing_that_was_recorded_steers_the_terminal(
    tmp_path: Path, run_command: RunCommand, words: tuple[str, ...]
) -> None:
    """Keys, names of robots and of counters, and prose, with sequences and lines of their own."""
    steer, path = "\x1b[2J\x9b31m\u202e\nquadriga: harmless", tmp_path / "run.mcap"
    none = np.zeros(0)
    with RecordingWriter(path, build_metadata(CONFIG, "")) as writer:
        for key, message in (
            (f"team/{steer}", msg.Clock(1, 1)),
            (f"team/{steer}/status", msg.Status(1, 1, steer, steer, "", {}, {}, none, none)),
            ("team/r1/status", msg.Status(1, 1, steer, steer, "", {}, {steer: 1}, none, none)),
            ("team/sim/event", msg.Event(1, 1, steer, steer, steer, steer)),
            ("team/r1/inputs", msg.Consumed(1, 1, 0, 0, (steer,), (steer,))),
        ):
            writer.write(key, encode(message), 5)
    _, lines, err = run_command(*words, path)
    assert lines
    assert not re.search("[\x1b\x9b\u202e]", "".join(lines) + err)
    assert not [line for line in lines if line.startswith("quadriga: harmless")]
