import pytest

from quadriga.shared.config.friction import friction_of_robots
from quadriga.shared.errors import ConfigError

NAMES = ("r1", "r2", "r3")


@pytest.mark.parametrize(
    ("text", "expected"),
    [("", (0.8, 0.8, 0.8)), ("r2:0.3", (0.8, 0.3, 0.8)), ("r3: 0.5, r1:0.25", (0.25, 0.8, 0.5))],
)
def test_who_is_named_finds_another_friction(text: str, expected: tuple[float, ...]) -> None:
    assert friction_of_robots(text, 0.8, NAMES) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("r4:0.3", "'r4', expected one of r1, r2, r3"),
        ("0.3", "'0.3', expected one of"),
        ("r2", "0.05 … 2"),
        ("r2:slippery", "0.05 … 2"),
        ("r2:nan", "0.05 … 2"),
        ("r2:0", "0.05 … 2"),
        ("r2:0.3,r2:0.4", "r2 twice"),
        ("r2:0.3,", "''"),
    ],
)
def test_a_mistake_names_the_key_and_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.friction_of: .*{message}"):
        friction_of_robots(text, 0.8, NAMES)
