import pytest

from quadriga.shared.config.per_robot import carriers, friction_of_robots
from quadriga.shared.errors import ConfigError

NAMES = ("r1", "r2", "r3")


def test_who_is_named_carries_a_part_or_finds_another_friction() -> None:
    parts = {"team": (1.0, 1.0, 1.0), "r3, r1": (1.0, 0.0, 1.0), "r1:6,r2": (6.0, 1.0, 0.0)}
    assert {text: carriers(text, NAMES) for text in parts} == parts
    frictions = {"": (0.8, 0.8, 0.8), "r3: 0.5, r1:0.25": (0.25, 0.8, 0.5)}
    assert {text: friction_of_robots(text, 0.8, NAMES) for text in frictions} == frictions


WRONG = ("r4:1", "r1:1,", "r1:1,r1:2", "r1:", "r1:heavy", "r1:-1", "r1:nan", "1")


@pytest.mark.parametrize("text", WRONG)
def test_a_mistake_names_the_key(text: str) -> None:
    with pytest.raises(ConfigError, match=r"^world\.payload_on: "):
        carriers(text, NAMES)
    with pytest.raises(ConfigError, match=r"^world\.friction_of: "):
        friction_of_robots(text, 0.8, NAMES)
    with pytest.raises(ConfigError):
        carriers("", NAMES)
    with pytest.raises(ConfigError):
        friction_of_robots("r2", 0.8, NAMES)
