"""The command line of an agent of one's own, and what its origin depends on."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.shared.agent_command import (
    PLACES,
    command_origin,
    environment_of,
    fill_in,
    parse_line,
)
from quadriga.shared.errors import ConfigError


def test_words_are_those_of_a_shell_and_braces_are_filled_in() -> None:
    words = parse_line("""python 'my walk.py' --robot={robot} --gains '{"kp": 80}'""")
    filled = fill_in(words, dict.fromkeys(PLACES, "") | {"robot": "r2"})
    assert filled == ("python", "my walk.py", "--robot=r2", "--gains", '{"kp": 80}')
    assert environment_of({"robot": "r2"}) == {"QUADRIGA_ROBOT": "r2"}


@pytest.mark.parametrize("line", ["python 'walk.py", "  ", "walk {robots}"])
def test_a_line_that_is_none_is_refused(line: str) -> None:
    with pytest.raises(ConfigError, match=r"^team\.agent_command: got"):
        parse_line(line)


def test_another_content_of_a_named_file_is_another_origin(tmp_path: Path) -> None:
    script, weights = tmp_path / "walk.py", tmp_path / "weights.bin"
    script.write_text("step = 1", encoding="utf-8")
    weights.write_bytes(b"1")
    line = f"python {script} --weights={weights} --fast"
    assert command_origin("") == ""
    before = command_origin(line)
    assert before.startswith(f"{line} ")
    assert command_origin(line) == before
    weights.write_bytes(b"2")
    after = command_origin(line)
    script.write_text("step = 2", encoding="utf-8")
    assert len({before, after, command_origin(line)}) == 3
