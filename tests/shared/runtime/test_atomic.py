"""A file is there whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.runtime.atomic import atomic_write, write_text


def test_a_file_is_replaced_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    write_text(path, "old")
    with atomic_write(path) as partial:
        partial.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert [*tmp_path.iterdir()] == [path]


def test_what_fails_leaves_all_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    write_text(path, "± old")

    def fail() -> None:
        with atomic_write(path) as partial:
            partial.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert path.read_text(encoding="utf-8") == "± old"
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS])
def test_where_nothing_can_be_written_the_file_is_named_and_what_helps(
    tmp_path: Path, number: int
) -> None:
    path = tmp_path / "notes.txt"
    reason = os.strerror(number)
    with pytest.raises(OSError, match=reason) as caught, atomic_write(path) as partial:
        raise OSError(number, reason, str(partial) if number == errno.EROFS else None)
    assert caught.value.filename == str(path)
    with pytest.raises(ConfigError) as told, name_file_errors(ConfigError, path, "room"):
        raise caught.value
    assert "XDG_CACHE_HOME" in told.value.cause
    assert ("free some room" in told.value.cause) == (number == errno.ENOSPC)


def test_a_link_stays_one_what_is_no_file_is_written_to_and_an_error_names_the_path(
    tmp_path: Path,
) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "file")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "new"
    write_text(Path("/dev/null"), "new")
    assert Path("/dev/null").is_char_device()
    with pytest.raises(OSError, match="No such file") as caught:
        write_text(tmp_path / "no" / "file", "new")
    assert caught.value.filename == str(tmp_path / "no" / "file")
