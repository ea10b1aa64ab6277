"""Trials that were walked already are read back, and what is none of them is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError
from quadriga.team.trial_rows import ROWS, append_row, keep_config, read_rows


def test_rows_are_read_back_whatever_their_texts_hold(tmp_path: Path) -> None:
    assert read_rows(tmp_path) == []
    rows: list[dict[str, Any]] = [
        {"fault": "imu", "seed": 3},
        {"why": "a line\u2028 and \n another", "ms": None},
    ]
    for row in rows:
        append_row(row, tmp_path)
    assert read_rows(tmp_path) == rows


@pytest.mark.parametrize(
    ("line", "got"),
    [
        (b'{"fault": "im', "Unterminated string"),
        (b'["imu"]', "list"),
        (b"[" * 30_000, "maximum recursion depth"),
        (b'{"seed": ' + b"9" * 5000 + b"}", "Exceeds the limit"),
    ],
)
def test_a_line_that_is_no_row_is_named(line: bytes, got: str, tmp_path: Path) -> None:
    (tmp_path / ROWS).write_bytes(b'{"seed": 1}\n' + line + b"\n")
    with pytest.raises(ConfigError, match=rf"rows\.jsonl, line 2: got {got}"):
        read_rows(tmp_path)


def test_a_file_that_is_no_text_is_one_error(tmp_path: Path) -> None:
    (tmp_path / ROWS).write_bytes(b"\xff\n")
    with pytest.raises(ConfigError, match=r"rows\.jsonl: got bytes that are not UTF-8"):
        read_rows(tmp_path)


def test_a_folder_holds_walks_of_one_configuration_whatever_their_seed(tmp_path: Path) -> None:
    keep_config(load(), tmp_path)
    keep_config(load(overrides={"world.seed": 9}), tmp_path)
    with pytest.raises(ConfigError, match=r"world.terrain = 'flat', not 'boxes', expected a new"):
        keep_config(load(overrides={"world.terrain": "boxes"}), tmp_path)
