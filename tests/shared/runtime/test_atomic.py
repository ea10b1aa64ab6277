"""A file is there whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from quadriga.shared.errors import ConfigError, name_file_errors
from quadriga.shared.runtime.atomic import atomic_write, write_text


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file with a text."""
    write_text(tmp_path / "notes.txt", "± old")
    return tmp_path / "notes.txt"


def test_a_file_is_replaced_as_a_whole_or_stays_as_it_was(path: Path) -> None:
    def fail() -> None:
        with atomic_write(path) as partial:
            partial.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    with atomic_write(path) as partial:
        partial.write_text("new")
        assert path.read_text(encoding="utf-8") == "± old"
    assert path.read_text() == "new"
    assert [*path.parent.iterdir()] == [path]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS])
def test_where_nothing_can_be_written_the_file_is_named_and_what_helps(
    path: Path, number: int
) -> None:
    reason = os.strerror(number)
    with pytest.raises(OSError, match=reason) as caught, atomic_write(path) as partial:
        raise OSError(number, reason, str(partial) if number == errno.EROFS else None)
    assert caught.value.filename == str(path)
    with pytest.raises(ConfigError) as told, name_file_errors(ConfigError, path, "room"):
        raise caught.value
    assert "XDG_CACHE_HOME" in told.value.cause
    assert ("free some room" in told.value.cause) == (number == errno.ENOSPC)


def test_a_link_stays_one_what_is_no_file_is_written_to_and_an_error_names_the_path(
    path: Path,
) -> None:
    link, nowhere = path.with_name("link"), path.with_name("no") / "file"
    link.symlink_to(path)
    write_text(link, "new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    write_text(Path("/dev/null"), "new")
    assert Path("/dev/null").is_char_device()
    with pytest.raises(OSError, match="No such file") as caught:
        write_text(nowhere, "new")
    assert caught.value.filename == str(nowhere)
