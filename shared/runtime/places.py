"""Where the project keeps what it need not make twice."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

import quadriga

# The folder that the package `quadriga` is in: the checkout, where it is installed from one.
SOURCE: Final = Path(quadriga.__file__).parents[1]


def cache_dir() -> Path:
    """The user's cache folder: $XDG_CACHE_HOME/quadriga, or ~/.cache/quadriga."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "quadriga"
