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
    more: str = "",
) -> Any:
    """Declare a configuration key: its default, unit, meaning and permitted range.

    Args:
        default: its value where nothing else is said.
        unit: of the value; "-" or "1" without one.
        doc: what it means.
        low: least value.
        high: greatest value.
        choices: all values of a text, or those that are known here if there may be `more`.
        hint: the likely cause of another choice than the permitted ones.
        more: what else is permitted beside the choices, in words; the check of the whole
            configuration then decides.
    """
    limits = {"low": low, "high": high, "choices": choices, "hint": hint, "more": more}
    meta = {"unit": unit, "doc": doc, **limits}
    if isinstance(default, (list, dict)):
        raise TypeError("a default must be immutable")
    return field(default=default, metadata=meta)
