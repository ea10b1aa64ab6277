"""The declaration of one configuration key."""

from __future__ import annotations

from dataclasses import field
from typing import Any


def key(
    default: Any,
    unit: str,
    doc: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
    hint: str = "",
) -> Any:
    """Declare a configuration key: its default, unit, meaning and permitted range.

    `hint` is the likely cause of another choice than the permitted ones.
    """
    meta = {"unit": unit, "doc": doc, "low": low, "high": high, "choices": choices, "hint": hint}
    if isinstance(default, (list, dict)):
        raise TypeError("a default must be immutable")
    return field(default=default, metadata=meta)
