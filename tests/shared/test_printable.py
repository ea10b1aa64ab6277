"""Text from elsewhere on a terminal: shown, and not obeyed."""

from __future__ import annotations

import pytest

from quadriga.shared.printable import printable, printable_line

SHOWN = "\N{REPLACEMENT CHARACTER}"


@pytest.mark.parametrize(
    "character",
    ["\x1b", "\x07", "\r", "\x9b", "\N{RIGHT-TO-LEFT OVERRIDE}", "\u2028", "\ud800"],
    ids=ascii,
)
def test_what_a_terminal_would_obey_is_replaced(character: str) -> None:
    assert printable(f"r2 {character}[31m fell") == f"r2 {SHOWN}[31m fell"


def test_all_else_stays_and_no_line_is_forged() -> None:
    text = "r2: 0.5 m · τ ≤ 33 N·m,\N{NO-BREAK SPACE}– \n next"
    assert printable(text) == text
    assert printable_line("stop\nquadriga: all is well") == "stop quadriga: all is well"
