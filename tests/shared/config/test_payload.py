import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.config.payload import carriers
from quadriga.shared.errors import ConfigError

NAMES = ("r1", "r2", "r3")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("team", (1.0, 1.0, 1.0)),
        ("r2", (0.0, 1.0, 0.0)),
        ("r3, r1", (1.0, 0.0, 1.0)),
        ("r1:6,r3:4", (6.0, 0.0, 4.0)),
        ("r1,r2:0.5", (1.0, 0.5, 0.0)),
    ],
)
def test_carriers_and_their_parts(text: str, parts: tuple[float, ...]) -> None:
    assert carriers(text, NAMES) == parts


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("r4", "'r4'"),
        ("", "''"),
        ("r1,", "''"),
        ("r1,r1:2", "r1 twice"),
        ("r1:", "0.001 … 1000"),
        ("r1:heavy", "0.001 … 1000"),
        ("r1:-1", "0.001 … 1000"),
        ("r1:nan", "0.001 … 1000"),
    ],
)
def test_a_wrong_carrier_names_the_key_and_what_is_wrong(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=rf"^world\.payload_on: .*{message}"):
        carriers(text, NAMES)


@given(st.text(alphabet="rteam123:.,- ", max_size=20))
def test_any_text_is_understood_or_refused(text: str) -> None:
    try:
        parts = carriers(text, NAMES)
    except ConfigError:
        return  # anything else fails the test
    assert len(parts) == 3
    assert sum(parts) > 0.0
