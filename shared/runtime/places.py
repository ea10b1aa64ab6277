"""Where files of the project are kept: the source, scenarios, and what need not be made twice."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Final

import quadriga

# The folder that the package `quadriga` is in: the checkout, where it is installed from one.
SOURCE: Final = Path(quadriga.__file__).parents[1]
_SCENARIOS: Final = SOURCE / "deploy" / "scenarios"
_INSTALLED_SCENARIOS: Final = Path(sys.prefix) / "share" / "quadriga" / "scenarios"


def cache_dir() -> Path:
    """The user's cache folder: $XDG_CACHE_HOME/quadriga, or ~/.cache/quadriga."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "quadriga"


def cache_file(kind: str, key: str) -> Path:
    """The file of the cache that holds what `key` stands for, a digest of all it depends on.

    Args:
        kind: what it is: `predictor`, `data`.
        key: of one file of this kind.
    """
    return cache_dir() / f"{kind}-{key}.npz"


def cache_files(kind: str) -> list[Path]:
    """All files of a kind in the cache, sorted by name."""
    return sorted(cache_dir().glob(f"{kind}-*.npz"))


def scenario_folder() -> Path:
    """Where scenarios and traces are kept: beside the source, or where it has been installed."""
    return _SCENARIOS if _SCENARIOS.is_dir() else _INSTALLED_SCENARIOS
