"""The commands that read recordings: what they say of good, damaged, foreign and future files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.records import Schema

from quadriga.commands.parser import main
from quadriga.recordings.metadata import build_metadata
from quadriga.shared.config.timing import periods
from quadriga.shared.errors import RecordingError
from quadriga.shared.recording import seal as recording_seal
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.mcap_chunk import check_schema
from quadriga.shared.recording.reader import Recording, RecordingWriter
from quadriga.shared.wire import messages as msg
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.messages import State
from tests.quadriga.conftest import run_config, write

Say = Callable[..., tuple[int, list[str], str]]
VERBS: dict[str, tuple[str, ...]] = {
    "info": ("info", "FILE"),
    "check": ("check", "FILE"),
    "recover": ("recover", "FILE", "-o", "OUT"),
    "echo": ("echo", "**", "--file", "FILE"),
    "hz": ("hz", "--file", "FILE"),
}
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
        for tick, kind, robot, detail in (
            (200, "push", "r1", "80 N"),
            (500, "fall", "r2", "tilt 1.0 rad"),
            (600, "stop", "", "fall of r2"),
        ):
            event = msg.Event(tick, tick * 1_000_000, kind, robot, detail)
            writer.write("team/sim/event", encode(event), entry.log_time_ns)
    return path


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str]) -> Say:
    """A function that runs a command: its exit status, lines on stdout, stderr."""

    def run(*arguments: object) -> tuple[int, list[str], str]:
        status = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return status, out.splitlines(), err

    return run


def words(verb: str, file: Path) -> list[str]:
    out = file.with_name("out.mcap")
    out.unlink(missing_ok=True)
    return [str({"FILE": file, "OUT": out}.get(word, word)) for word in VERBS[verb]]


def test_info_says_it_all(small: Path, say: Say) -> None:
    status, lines, err = say("info", small)
    assert (status, err) == (0, "")
    text = "\n".join(lines)
    for line in (
        r"  file +0\.\d\d MB, whole",
        r"  world time +0\.600 s",
        r"  falls +r2",
        r"  end +fall of r2",
        r"  predictor +cdcdcdcdcdcdcdcd",
        r"  versions +python",
        r"  team +team, 2 robots, lockstep, flat, seed 7",
        r"  team/r1/state +State +601 +1000\.0 +0 +600 +0",
        r"  team/r2/plan +Plan +5 +25\.0 +400 +560 +0",
        r"  world\.seed +7  \(default 0\)",
        r"  team\.robots +2  \(default 3\)",
        r"  0\.200 s  push +r1  80 N",
        r"  r1  walk +qp_fallback 0",
    ):
        assert re.search(f"^{line}", text, re.MULTILINE), line
    assert "reference.vx" not in text  # it is the default


def test_info_names_gaps_and_reasons_to_stop(tmp_path: Path, say: Say) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | None:
        if isinstance(message, msg.Status) and message.tick == 500 and "r2" in key:
            return replace(message, mode="stopping", reason="peer-lost:r1")
        return None if key == "team/r1/command" and 100 <= message.tick < 110 else message

    _, lines, _ = say("info", write(tmp_path, CONFIG, change=change) / "run.mcap")
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
def test_metadata_of_anybody_do_no_harm(tmp_path: Path, say: Say, versions: str) -> None:
    path = tmp_path / "odd.mcap"
    told = build_metadata(CONFIG, "") | {"versions": versions, "topics": versions}
    with RecordingWriter(path, told, 16, periods=periods(CONFIG)) as writer:
        writer.write("team/sim/event", encode(msg.Event(200, 0, "stop", "", "\x1b[2J\nend")), 0)
    status, lines, err = say("info", path)
    assert (status, err) == (0, "")
    assert "\x1b" not in "".join(lines)
    assert re.search(r"^  end +\ufffd\[2J end$", "\n".join(lines), re.MULTILINE)


@odd_versions
def test_a_report_shows_metadata_of_anybody(
    tmp_path: Path, small: Path, say: Say, versions: str
) -> None:
    path, source = tmp_path / "odd.mcap", Recording(small)
    told = dict(source.metadata) | {"versions": versions}
    with RecordingWriter(path, told, 16, periods=periods(CONFIG)) as writer:
        for entry in source.entries():
            writer.write(entry.key, entry.payload, entry.log_time_ns)
    status, lines, err = say("report", path, "--html", tmp_path / "odd.html")
    assert (status, err) == (1, "")  # it tells of a fall
    assert "\x1b" not in "".join(lines)


@pytest.mark.parametrize("text", ["[" * 100_000, "[]", "no JSON"], ids=["nested", "list", "text"])
def test_a_configuration_that_is_none_is_one_clear_error(
    tmp_path: Path, say: Say, text: str
) -> None:
    path = tmp_path / "odd.mcap"
    with RecordingWriter(path, build_metadata(CONFIG, "") | {"config_json": text}) as writer:
        writer.write("team/r1/state", b"", 0)
    status, _, err = say("report", path)
    assert (status, err.count("\n")) == (2, 1)
    assert "odd.mcap: got metadata without a configuration" in err


def test_a_key_that_nests_as_deeply_as_can_be_read_is_one_clear_error(tmp_path: Path) -> None:
    for depth in range(800, 1000, 5):
        path = tmp_path / f"{depth}.mcap"
        told = {"config_json": f'{{"world": {{"seed": {"[" * depth}{"]" * depth}}}}}'}
        with RecordingWriter(path, build_metadata(CONFIG, "") | told) as writer:
            writer.write("team/r1/state", b"", 0)
        with pytest.raises(RecordingError):
            recorded_config(Recording(path))


def test_a_schema_that_is_no_sensible_json_is_not_obeyed() -> None:
    for text in (b"[" * 100_000, b"no JSON", b"[]"):
        check_schema(Schema(data=text, encoding="jsonschema", id=1, name="quadriga.State"), "file")


def test_echo_is_one_readable_line_a_message(small: Path, say: Say) -> None:
    _, lines, _ = say("echo", "r1/state", "--file", small, "-n", 3)
    assert len(lines) == 3
    assert lines[1].startswith("    0.001 s  team/r1/state  q_joint=[0 ")
    assert " … 12] v_joint=[0 0 0 0 … 12]" in lines[1]
    _, lines, _ = say("echo", "r2/plan", "--file", small, "-n", 1, "--full")
    assert "used={r1:9}" in lines[0]
    assert "u=[25×12:" in lines[0]
    assert "…" not in lines[0]
    assert len(re.findall(r"u=\[25×12:([^]]*)\]", lines[0])[0].split()) == 300
    _, lines, _ = say("echo", "sim/event", "--file", small)
    assert lines[1] == "    0.500 s  team/sim/event  kind='fall' robot='r2' detail='tilt 1.0 rad'"


def test_echo_shows_what_is_no_message(tmp_path: Path, say: Say) -> None:
    with RecordingWriter(tmp_path / "run.mcap", build_metadata(CONFIG, "")) as writer:
        writer.write("team/r1/state", b"\x01garbage", 5)
        writer.write("team/some/thing", b"\x00" * 100, 5)
    _, lines, _ = say("echo", "**", "--file", tmp_path / "run.mcap")
    assert "8 bytes, state is" in lines[0]
    assert "100 bytes, key is 'team/some/thing': 00 00" in lines[1]


def test_a_key_that_is_not_there_is_no_silence(small: Path, say: Say) -> None:
    for verb in ("echo", "hz"):
        status, _, err = say(verb, "r7", "r1/stat", "--file", small)
        assert (status, err.count("\n")) == (2, 1)
        assert "run.mcap: got no key that fits r7 r1/stat, expected some of team/r1/command" in err


def test_a_run_folder_stands_for_its_recording(small: Path, say: Say) -> None:
    assert say("info", small.parent) == say("info", small)
    assert say("echo", "plan", "--file", small.parent) == say("echo", "plan", "--file", small)


def test_hz_knows_rates_intervals_and_gaps(tmp_path: Path, say: Say) -> None:
    def change(key: str, message: msg.Message) -> msg.Message | None:
        return None if key == "team/r1/state" and 100 <= message.tick < 105 else message

    run = write(tmp_path, CONFIG, change=change) / "run.mcap"
    _, lines, _ = say("hz", "r1", "sim/truth", "--file", run)
    rows = {line.split()[0]: re.split(r"  +", line) for line in lines[1:]}
    assert rows["team/r1/state"][1:] == ["596", "991.7", "1 – 6", "495.8", "2.0 – 12.0", "5"]
    assert rows["team/sim/truth"][1:] == ["61", "100.0", "10 – 10", "50.0", "20.0 – 20.0", "0"]
    assert "team/r2/state" not in rows


@pytest.mark.parametrize("verb", VERBS)
def test_each_file_that_is_none_gives_one_clear_error(
    small: Path, tmp_path: Path, say: Say, monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    whole = small.read_bytes()
    path = tmp_path / "bad.mcap"
    for content, message in (
        (None, "No such file"),
        (b"", "an empty file"),
        (b"PK\x03\x04 a zip of something" * 50, "hold nothing of a recording"),
        (whole.replace(b"quadriga", b"somebody")[:5000], "hold nothing of a recording"),
    ):
        path.unlink(missing_ok=True)
        if content is not None:
            path.write_bytes(content)
        status, _, err = say(*words(verb, path))
        assert (status, err.count("\n")) == (2, 1), (verb, message, err)
        assert f"quadriga: {path}: got" in err
        assert message in err
    path.unlink()
    with monkeypatch.context() as future:
        future.setattr(recording_seal, "FORMAT", 2)
        RecordingWriter(path, build_metadata(CONFIG, "")).finish()
    status, _, err = say(*words(verb, path))
    assert (status, err.count("\n")) == (2, 1)
    assert "got a recording of format 2, expected format 1 (recorded by a newer quadriga" in err
    path.unlink()
    with monkeypatch.context() as future:
        future.setattr(State, "SCHEMA", 2)
        with RecordingWriter(path, build_metadata(CONFIG, "")) as writer:
            writer.write("team/r1/state", b"\x80", 0)
    status, _, err = say(*words(verb, path))
    assert (status, err.count("\n")) == (2, 1)
    assert "got messages quadriga.State of schema 2, expected schema 1" in err


@pytest.mark.parametrize("verb", VERBS)
def test_a_cut_file_gives_one_clear_error_and_what_is_readable(
    small: Path, tmp_path: Path, say: Say, verb: str
) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(small.read_bytes()[: small.stat().st_size // 2])
    status, lines, err = say(*words(verb, path))
    assert len(lines) > 5
    if verb == "recover":
        assert (status, err) == (0, "")
        assert lines[0].startswith("damaged: a file that is cut after")
    elif verb == "check":
        assert (status, err) == (1, "")
        assert lines[0].startswith("FAIL  whole")
    else:
        assert (status, err.count("\n")) == (2, 1)
        assert "got a file that is cut after" in err
        assert "`quadriga recover`" in err


def test_recover_makes_a_whole_file_and_says_what_is_lost(
    small: Path, tmp_path: Path, say: Say
) -> None:
    content = bytearray(small.read_bytes())
    content[content.index(b"lz4", len(content) // 3) + 100] ^= 4
    path = tmp_path / "flipped.mcap"
    path.write_bytes(content)
    status, lines, _ = say("recover", path)
    text = "\n".join(lines)
    assert status == 0
    before = list(Recording(small).entries())
    recovered = Recording(tmp_path / "flipped.recovered.mcap")
    recovered.require_whole()
    after = list(recovered.entries())
    assert f"{len(after):,} of {len(before):,} messages recovered" in text
    assert "a chunk that fails its checksum" in text
    lost = sorted({e.tick for e in before} - {e.tick for e in after if e.key == "team/r1/state"})
    assert re.search(rf"team/r1/state +\d+  between ticks {lost[0] - 1}–", text)
    assert recovered.metadata == Recording(small).metadata
    assert recovered.notes()["quadriga.recovered"]["from"] == "flipped.mcap"
    again = say("recover", path)
    assert (again[0], "never overwritten" in again[2]) == (2, True)
    assert say("recover", small) == (0, [f"{small} is whole: nothing to recover"], "")


@settings(
    max_examples=12,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
@given(data=st.data())
def test_no_damage_makes_a_command_fall_over(
    small: Path, tmp_path: Path, say: Say, data: st.DataObject
) -> None:
    content = bytearray(small.read_bytes())
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    del content[data.draw(st.integers(1, len(content))) :]
    if bytes(content) == small.read_bytes():
        return
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    originals = set(Recording(small).entries())
    for verb in VERBS:
        status, _, err = say(*words(verb, path))
        assert status in ((0, 2) if verb == "recover" else (1, 2)), (verb, err)
        assert err.count("\n") <= 1
    out = tmp_path / "out.mcap"
    if out.exists():
        assert originals.issuperset(Recording(out).entries())


def test_the_configuration_of_a_damaged_file_may_be_gone(
    small: Path, tmp_path: Path, say: Say
) -> None:
    content = small.read_bytes()
    at = content.index(b"config_json")
    content = content[: at + 20] + b"\xff" * 20 + content[at + 40 : len(content) // 2]
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    status, lines, err = say("info", path)
    assert (status, err.count("\n")) == (2, 1)
    assert any("team/r1/state" in line for line in lines)
    status, lines, _ = say("recover", path)
    assert "lost: configuration and versions, no copy of them is intact" in lines
    assert say("check", path)[0] == 2
    assert json.loads(Recording(small).metadata["config_json"])["world"]["seed"] == 7
