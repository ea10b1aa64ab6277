"""What an error says is a line that somebody reads to its end."""

from __future__ import annotations

from quadriga.shared.errors import ConfigError


def test_what_others_wrote_is_shown_no_further_than_somebody_reads() -> None:
    error = ConfigError("x" * 5000, "y" * 500, "one of a, b", "a typo?")
    assert str(error).startswith("x" * 500 + "… (5,000 characters): got " + "y" * 500 + ", exp")
    assert error.name == "x" * 5000
