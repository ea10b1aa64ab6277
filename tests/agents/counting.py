"""Functions that keep what they return, in the place of those of the code under test."""

from __future__ import annotations

from typing import Any

import pytest


def count_calls(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> list[Any]:
    """What each call of a module's or class's function returns from now on."""
    results: list[Any] = []
    function = getattr(owner, name)

    def counted(*given: Any) -> Any:
        results.append(function(*given))
        return results[-1]

    monkeypatch.setattr(owner, name, counted)
    return results
