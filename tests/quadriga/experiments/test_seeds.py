"""Seeds as text."""

from __future__ import annotations

import pytest

from quadriga.experiments.seeds import format_seeds, parse_seeds
from quadriga.shared.errors import ConfigError


@pytest.mark.parametrize(
    ("text", "seeds"), [("0:3", (0, 1, 2)), ("7", (7,)), ("5,1, 0:2", (5, 1, 0)), ("3,3", (3,))]
)
def test_seeds_are_read(text: str, seeds: tuple[int, ...]) -> None:
    assert parse_seeds("--seeds", text) == seeds


@pytest.mark.parametrize(
    "text", ["", "a", "3:1", "2:2", "-1", "1:", ":3", "1:2:3", "0.5", "1,,2", "9" * 5000]
)
def test_what_are_no_seeds_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="--seeds"):
        parse_seeds("--seeds", text)


def test_seeds_in_a_row_are_shown_by_their_ends() -> None:
    assert format_seeds([3, 0, 1, 2, 7, 9, 10]) == "0 … 3, 7, 9, 10"
    assert format_seeds([]) == ""


@pytest.mark.parametrize("text", ["0:99999999999999", "0:600000,600000:1200000"])
def test_more_seeds_than_anybody_walks_are_refused_at_once(text: str) -> None:
    with pytest.raises(ConfigError, match=r"at most 1,000,000 seeds"):
        parse_seeds("--seeds", text)
