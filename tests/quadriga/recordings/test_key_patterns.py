"""Which keys a pattern means, and what must be subscribed to."""

from __future__ import annotations

import pytest

from quadriga.recordings.key_patterns import key_pattern
from quadriga.shared.errors import ConfigError

KEYS = (
    "team/r1/state", "team/r1/plan", "team/r2/plan", "team/planner/status", "team/r1/status",
    "team/reference", "team/sim/truth", "team/sim/event", "team/other/deep/key",
)  # fmt: skip


@pytest.mark.parametrize(
    ("text", "expression", "matched"),
    [
        ("plan", "team/*/plan", ("team/r1/plan", "team/r2/plan")),
        ("sim/truth", "team/sim/truth", ("team/sim/truth",)),
        ("reference", "team/reference", ("team/reference",)),
        ("r1", "team/**", ("team/r1/state", "team/r1/plan", "team/r1/status")),
        ("st*", "team/**", ("team/r1/state", "team/planner/status", "team/r1/status")),
        ("r1/plan", "team/r1/plan", ("team/r1/plan",)),
        ("team/r1/plan", "team/r1/plan", ("team/r1/plan",)),
        ("r?/plan", "team/*/plan", ("team/r1/plan", "team/r2/plan")),
        ("sim/*", "team/sim/*", ("team/sim/truth", "team/sim/event")),
        ("other/**", "team/other/**", ("team/other/deep/key",)),
        ("**/status", "team/**/status", ("team/planner/status", "team/r1/status")),
        ("**", "team/**", KEYS),
        ("r3", "team/**", ()),
    ],
)
def test_patterns(text: str, expression: str, matched: tuple[str, ...]) -> None:
    pattern = key_pattern(text, "team")
    assert pattern.expression == expression
    assert tuple(key for key in KEYS if pattern.matches(key)) == matched


@pytest.mark.parametrize("text", ["", "/", "r1//plan", "r1/", "a b", "r1/$x", "#"])
def test_what_cannot_be_a_key(text: str) -> None:
    with pytest.raises(ConfigError, match="--topics"):
        key_pattern(text, "team", "--topics")
