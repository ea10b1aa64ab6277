"""Where the project keeps what it need not make twice."""

from __future__ import annotations

import os
from pathlib import Path


def cache_dir() -> Path:
    """The user's cache folder: $XDG_CACHE_HOME/quadriga, or ~/.cache/quadriga."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "quadriga"
