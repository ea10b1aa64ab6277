"""What the commands that read recordings say of damaged, foreign and future files."""

from __future__ import annotations

import json
import re
from io import BytesIO
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from quadriga.shared.recording.reader import Recording
from tests.quadriga.commands.conftest import RunCommand

VERBS: dict[str, tuple[str, ...]] = {
    "info": ("info", "FILE"),
    "info --check": ("info", "--check", "FILE"),
    "recover": ("recover", "FILE", "-o", "OUT"),
    "echo": ("echo", "**", "--file", "FILE"),
    "echo --rates": ("echo", "--rates", "--file", "FILE"),
}


def words(verb: str, file: Path) -> list[str]:
    out = file.with_name("out.mcap")
    out.unlink(missing_ok=True)
    return [str({"FILE": file, "OUT": out}.get(word, word)) for word in VERBS[verb]]


@pytest.mark.parametrize("verb", VERBS)
def test_each_file_that_is_none_gives_one_clear_error(
    small: Path, tmp_path: Path, run_command: RunCommand, verb: str
) -> None:
    whole = small.read_bytes()
    path, of_others = tmp_path / "bad.mcap", BytesIO()
    writer = Writer(of_others)
    writer.start()
    writer.add_message(writer.register_channel("/odom", "cdr", 0), 1, b"\0\1", 1)
    writer.finish()
    for content, message in (
        (None, "No such file"),
        (b"", "an empty file"),
        (b"PK\x03\x04 a zip of something" * 50, "do not start as MCAP"),
        (whole.replace(b"quadriga", b"somebody")[:5000], "no metadata of this project"),
        (of_others.getvalue(), "no metadata of this project"),
    ):
        path.unlink(missing_ok=True)
        if content is not None:
            path.write_bytes(content)
        status, _, err = run_command(*words(verb, path))
        assert (status, err.count("\n")) == (2, 1), (verb, message, err)
        assert f"quadriga: {path}: got" in err
        assert message in err


@pytest.mark.parametrize("verb", VERBS)
def test_a_cut_file_gives_one_clear_error_and_what_is_readable(
    small: Path, tmp_path: Path, run_command: RunCommand, verb: str
) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(small.read_bytes()[: small.stat().st_size // 2])
    status, lines, err = run_command(*words(verb, path))
    assert len(lines) > 5
    if verb == "recover":
        assert (status, err) == (0, "")
        assert lines[0].startswith("damaged: a file that is cut after")
    elif verb == "info --check":
        assert (status, err) == (1, "")
        assert lines[0].startswith("FAIL  whole")
    else:
        assert (status, err.count("\n")) == (2, 1)
        assert "got a file that is cut after" in err
        assert "`quadriga recover`" in err


def test_recover_makes_a_whole_file_and_says_what_is_lost(
    small: Path, tmp_path: Path, run_command: RunCommand
) -> None:
    content = bytearray(small.read_bytes())
    content[content.index(b"lz4", len(content) // 3) + 100] ^= 4
    path = tmp_path / "flipped.mcap"
    path.write_bytes(content)
    status, lines, _ = run_command("recover", path)
    text = "\n".join(lines)
    assert status == 0
    before = list(Recording(small).entries())
    recovered = Recording(tmp_path / "flipped.recovered.mcap")
    recovered.require_whole()
    after = list(recovered.entries())
    assert f"{len(after):,} of {len(before):,} messages recovered" in text
    assert "its checksum is wrong" in text
    lost = sorted({e.tick for e in before} - {e.tick for e in after if e.key == "team/r1/state"})
    assert re.search(rf"team/r1/state +\d+  between ticks {lost[0] - 1}–", text)
    assert recovered.metadata == Recording(small).metadata
    assert recovered.notes["quadriga.recovered"]["from"] == "flipped.mcap"
    again = run_command("recover", path)
    assert (again[0], "never overwritten" in again[2]) == (2, True)
    assert run_command("recover", small) == (0, [f"{small} is whole: nothing to recover"], "")


@settings(
    max_examples=12,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
@given(data=st.data())
def test_no_damage_makes_a_command_fall_over(
    small: Path, tmp_path: Path, run_command: RunCommand, data: st.DataObject
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
        status, _, err = run_command(*words(verb, path))
        assert status in ((0, 2) if verb == "recover" else (1, 2)), (verb, err)
        assert err.count("\n") <= 1
    out = tmp_path / "out.mcap"
    if out.exists():
        assert originals.issuperset(Recording(out).entries())


def test_the_configuration_of_a_damaged_file_may_be_gone(
    small: Path, tmp_path: Path, run_command: RunCommand
) -> None:
    content = small.read_bytes()
    at = content.index(b"config_json")
    content = content[: at + 20] + b"\xff" * 20 + content[at + 40 : len(content) // 2]
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    status, lines, err = run_command("info", path)
    assert (status, err.count("\n")) == (2, 1)
    assert any("team/r1/state" in line for line in lines)
    status, lines, _ = run_command("recover", path)
    assert "lost: configuration and versions, no copy of them is intact" in lines
    assert run_command("info", "--check", path)[0] == 2
    assert json.loads(Recording(small).metadata["config_json"])["world"]["seed"] == 7
