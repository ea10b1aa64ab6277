"""Records: data classes in all but the assignment of attributes."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest

from quadriga.shared.runtime.record import record


@record
class Pair:
    """Two numbers."""

    first: int
    second: int = 2


def test_a_record_is_a_data_class_with_slots_that_the_type_checker_sees_frozen() -> None:
    pair = Pair(1)
    assert pair == Pair(1, 2)
    assert replace(pair, second=3) == Pair(1, 3)
    assert [item.name for item in fields(Pair)] == ["first", "second"]
    with pytest.raises(AttributeError):
        pair.third = 3  # type: ignore[attr-defined]
    pair.first = 5  # type: ignore[misc]  # unused, and so an error of the type checker, if not
