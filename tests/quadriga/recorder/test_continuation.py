"""A recorder that is started again while its team walks overwrites nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.recorder.continuation import choose_path


def never() -> bool:
    raise AssertionError("nobody asks")


def test_a_new_file_is_what_was_asked_for(tmp_path: Path) -> None:
    assert choose_path(tmp_path / "run.mcap", never, print) == (tmp_path / "run.mcap", None)


def test_each_recorder_has_a_file_of_its_own_and_says_so(tmp_path: Path) -> None:
    said = list[str]()
    first, second, third = (tmp_path / f"run{n}.mcap" for n in ("", ".2", ".3"))
    first.touch()
    assert choose_path(first, lambda: True, said.append) == (second, first)
    second.touch()
    assert choose_path(first, lambda: True, said.append) == (third, second)
    assert said[0] == "run.mcap is there already: this recording goes on in run.2.mcap"


@pytest.mark.parametrize("name", ["run.mcap", "other"])
def test_where_no_team_walks_it_is_a_mistake(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.touch()
    assert choose_path(path, lambda: False, print) == (path, None)
