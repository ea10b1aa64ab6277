"""Tables for people: what a recording from elsewhere says is shown, and not obeyed."""

from __future__ import annotations

import pytest

from quadriga.tables import Table, align_columns, print_tables


def test_control_characters_do_not_reach_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    print_tables([Table("Events", ("what", "said"), (("stop", "\x1b]0;mine\x07\x1b[2J done"),))])
    output = capsys.readouterr().out
    assert "done" in output
    assert "\x1b" not in output
    assert "\x07" not in output


def test_a_row_of_columns_is_one_line_that_a_terminal_only_shows() -> None:
    assert align_columns([("a", "x\x1b[31m\ny"), ("long", "z")]) == [
        "  a     x\N{REPLACEMENT CHARACTER}[31m y",
        "  long  z",
    ]


@pytest.mark.parametrize(
    ("heading", "first", "told"),
    [("roll [mrad]", "r1", True), ("r1", "yaw rate mrad/s", True), ("vx [mm/s]", "r1", False)],
)
def test_a_table_with_angles_tells_what_a_degree_is(
    heading: str, first: str, told: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    table = Table("Errors", ("robot", heading), ((first, "17.5"),), ("A note.",))
    print_tables([table])
    for text in (capsys.readouterr().out, table.to_markdown()):
        assert ("17.5 mrad are 1°." in text) == told
        assert "A note." in text
