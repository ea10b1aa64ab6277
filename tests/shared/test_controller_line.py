"""The command line of a controller of one's own, and what its origin depends on."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.shared.controller_line import (
    PLACES,
    controller_origin,
    environment_of,
    fill_in,
    parse_line,
)
from quadriga.shared.errors import ConfigError


def test_words_are_those_of_a_shell_and_braces_are_filled_in() -> None:
    words = parse_line("""python 'my walk.py' --robot={robot} --gains '{"kp": 80}'""")
    assert fill_in(words, dict.fromkeys(PLACES, "") | {"robot": "r2"}) == (
        "python",
        "my walk.py",
        "--robot=r2",
        "--gains",
        '{"kp": 80}',
    )


def test_the_environment_tells_the_same() -> None:
    assert environment_of({"robot": "r2", "mode": "peer"}) == {
        "QUADRIGA_ROBOT": "r2",
        "QUADRIGA_MODE": "peer",
    }


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("python 'walk.py", "no closing quotation"),
        ("  ", "expected a command line, or ''"),
        ("walk {robots}", r"got {robots} in 'walk {robots}', expected one of {robot}, {team}"),
    ],
)
def test_a_line_that_is_none_is_refused(line: str, message: str) -> None:
    with pytest.raises(ConfigError, match=r"^team\.controller: got") as error:
        parse_line(line)
    assert message in str(error.value)


def test_another_content_of_a_named_file_is_another_origin(tmp_path: Path) -> None:
    script, weights = tmp_path / "walk.py", tmp_path / "weights.bin"
    script.write_text("step = 1", encoding="utf-8")
    weights.write_bytes(b"1")
    line = f"python {script} --weights={weights} --fast"
    assert controller_origin("") == ""
    before = controller_origin(line)
    assert before.startswith(f"{line} ")
    assert controller_origin(line) == before
    weights.write_bytes(b"2")
    after = controller_origin(line)
    assert after != before
    script.write_text("step = 2", encoding="utf-8")
    assert controller_origin(line) not in (before, after)
