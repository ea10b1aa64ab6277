"""Where files of the project are kept: the source, scenarios, and what need not be made twice."""

from __future__ import annotations

import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Final

import quadriga

# The folder that the package `quadriga` is in: the checkout, where it is installed from one.
SOURCE: Final = Path(quadriga.__file__).parents[1]
_OF_OTHERS: Final = 0o077  # permissions of others than the owner
# Files that come with the code: in a checkout links to `deploy`, where they are kept.
SCENARIOS: Final = SOURCE / "quadriga" / "deploy" / "scenarios"  # and traces
EXPERIMENTS: Final = SOURCE / "quadriga" / "deploy" / "experiments"


def cache_dir() -> Path:
    """The user's cache folder: $XDG_CACHE_HOME/quadriga, or ~/.cache/quadriga."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "quadriga"


def runtime_dir() -> Path:
    """The user's folder of what is true while processes run: $XDG_RUNTIME_DIR/quadriga.

    Where the system has none it is in the folder of temporary files, which others may write to:
    whoever reads there must see whose it is.
    """
    if base := os.environ.get("XDG_RUNTIME_DIR"):
        return Path(base) / "quadriga"
    return Path(tempfile.gettempdir()) / f"quadriga-{os.getuid()}"


def make_runtime_dir() -> Path | None:
    """That folder, made if there is none; None if it cannot be this user's alone."""
    folder = runtime_dir()
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        about = folder.lstat()  # not of what a link points to
        private = about.st_uid == os.getuid() and not about.st_mode & _OF_OTHERS
        if stat.S_ISDIR(about.st_mode) and private:
            return folder
    return None


def cache_file(kind: str, key: str) -> Path:
    """The file of the cache, of a kind such as `data`, that holds what `key` stands for.

    The key is a digest of all that it depends on.
    """
    return cache_dir() / f"{kind}-{key}.npz"


def cache_files(kind: str) -> list[Path]:
    """All files of a kind in the cache, sorted by name."""
    return sorted(cache_dir().glob(f"{kind}-*.npz"))
