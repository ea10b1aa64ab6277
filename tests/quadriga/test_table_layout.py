"""No width cuts a number: a table is shown as it is, turned, or some columns at a time."""

from __future__ import annotations

import os
import re
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from unittest.mock import patch

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.table_layout import lay_out, total
from quadriga.tables import Table, print_tables

WIDTHS = (60, 80, 120, 200)
_ESCAPE = re.compile("\x1b\\[[0-9;]*m")
CAMPAIGN = Table(
    "Success",
    (
        "scenario, planner",
        *("walks", "success", "95 % interval", "falls", "difference of falls", "interval of that"),
        *("RMSE z [mm]", "RMSE vx [mm/s]", "RMSE vy [mm/s]", "RMSE roll [mrad]", "p"),
    ),
    tuple(
        (
            f"hard-blocks, {planner}",
            *("1,000", "100 %", "99.6 – 100 %", "0", "−12.5 %", "−14.8 – −10.2 %"),
            *("12.3", "123.4", f"{k}56.7", "10.1", "0.0001"),
        )
        for k, planner in enumerate(("none", "distributed", "decentralised", "centralised"))
    ),
)
FAULTS = Table(
    "Faults",
    ("fault", "what"),
    (
        ("kill-r2", "the agent of r2 is killed: " + "its robot is led down, others stand. " * 4),
        ("freeze-sim", "the world is stopped"),
    ),
)


def shown(table: Table, width: int) -> list[str]:
    """The lines of a terminal of this width."""
    with patch.dict(os.environ, {"FORCE_COLOR": "1", "COLUMNS": str(width), "TERM": "xterm"}):
        out = StringIO()
        with redirect_stdout(out):
            print_tables([table])
    return _ESCAPE.sub("", out.getvalue()).splitlines()


def cells_of(lines: list[str]) -> set[str]:
    """What stands between the borders of a table."""
    return {cell.strip() for line in lines for cell in re.split("[│┃]", line)}


@pytest.mark.parametrize("width", WIDTHS)
def test_no_number_is_cut(width: int) -> None:
    lines = shown(CAMPAIGN, width)
    assert max(map(len, lines)) <= width
    assert {cell for row in CAMPAIGN.rows for cell in row[1:]} <= cells_of(lines)
    for name, *_ in CAMPAIGN.rows:  # of a table that is turned a heading, which may have two lines
        assert all(word in " ".join(lines) for word in name.split())
    assert not any("…" in line for line in lines)


@pytest.mark.parametrize(
    ("width", "note"),
    [
        (60, "in 5 parts to fit into 60 characters: side by side they have 143, and stand so"),
        (80, "in 3 parts to fit into 80 characters"),
        (120, "turned to fit into 120 characters: it has 143"),
        (200, "a note of its own"),
    ],
)
def test_a_line_says_where_all_columns_are(width: int, note: str) -> None:
    text = " ".join(shown(replace(CAMPAIGN, notes=["a note of its own"]), width))
    assert note in text
    assert "a note of its own" in text
    assert ("characters:" in text) is (width < 200)


def test_a_pipe_gets_all_columns_side_by_side(capsys: pytest.CaptureFixture[str]) -> None:
    wide = Table("Wide", ("name", *("a number" for _ in range(30))), (("r1", *["123.456"] * 30),))
    print_tables([wide])
    lines = capsys.readouterr().out.splitlines()
    assert any(line.count("123.456") == 30 for line in lines)


@pytest.mark.parametrize("width", WIDTHS)
def test_prose_is_broken_between_words_alone(width: int) -> None:
    lines = shown(FAULTS, width)
    assert max(map(len, lines)) <= width
    told = " ".join(re.split("[│┃]", line)[2].strip() for line in lines if line.startswith("│"))
    assert " ".join(told.split()) == " ".join(f"{FAULTS.rows[0][1]} {FAULTS.rows[1][1]}".split())
    assert not any("characters:" in line for line in lines)


def test_two_columns_that_are_too_wide_stay_whole() -> None:
    name = "a-name-without-any-space-that-is-longer-than-the-terminal-is-wide"
    lines = shown(Table("Long", ("name", "n"), ((name, "12"),)), 60)
    assert {name, "12"} <= cells_of(lines)


TEXTS = st.text("abc 12.5%", min_size=0, max_size=30)


@given(st.integers(1, 7), st.integers(0, 6), st.integers(10, 200), st.data())
def test_every_cell_is_there_and_its_column_wide_enough(
    across: int, down: int, width: int, data: st.DataObject
) -> None:
    columns = tuple(data.draw(st.lists(TEXTS, min_size=across, max_size=across)))
    rows = [
        tuple(data.draw(st.lists(TEXTS, min_size=across, max_size=across))) for _ in range(down)
    ]
    layout = lay_out(columns, rows, width)
    found = [cell for part in layout.parts for row in (part.columns, *part.rows) for cell in row]
    for cell in (*columns, *(cell for row in rows for cell in row)):
        assert cell in found
    for part in layout.parts:
        assert total(part.widths) <= width or len(part.columns) <= 2
        for row in (part.columns, *part.rows):
            for cell, given_width in zip(row, part.widths, strict=True):
                assert max(map(len, cell.split()), default=0) <= given_width
                assert len(cell) <= max(given_width, 30)
    assert (len(layout.parts) > 1) <= bool(layout.note)
