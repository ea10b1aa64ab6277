"""A cache folder of a test's own, in which what the code does need not be found out again."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.shared.runtime.places import cache_dir

_BEHAVIOUR = "behaviour"


def share_behaviour(folder: Path) -> None:
    """Let `folder`, as XDG_CACHE_HOME, have the digests of behaviour of the cache in use.

    They depend on the code alone, and each process with a cache that lacks them walks for ten
    seconds to find them. Data, predictors and all else are not shared.
    """
    shared, own = cache_dir() / _BEHAVIOUR, folder / "quadriga" / _BEHAVIOUR
    if own.exists():
        return
    shared.mkdir(parents=True, exist_ok=True)
    own.parent.mkdir(parents=True, exist_ok=True)
    own.symlink_to(shared.resolve(), target_is_directory=True)


def use_own_cache(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Make `folder` the cache."""
    share_behaviour(folder)
    patch.setenv("XDG_CACHE_HOME", str(folder))
