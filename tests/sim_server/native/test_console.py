"""Lines from a pipe: whole ones, as they come, without ever waiting."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.sim_server.native.console import Console


@pytest.fixture
def pipe() -> Iterator[tuple[Console, int]]:
    out, into = os.pipe()
    yield Console(out), into
    os.close(out)


def test_partial_lines_wait_for_their_ends(pipe: tuple[Console, int]) -> None:
    console, into = pipe
    assert console.lines() == []
    os.write(into, b"r1 lo")
    assert console.lines() == []
    os.write(into, b"ss 0.1\n\n  r2 off \nr1")
    assert console.lines() == ["r1 loss 0.1", "r2 off"]
    os.write(into, b" on")
    os.close(into)
    assert console.lines() == []
    assert console.lines() == ["r1 on"], "the last line needs no end"
    assert console.lines() == []


def test_long_lines_and_bytes_that_are_no_text_do_no_harm(pipe: tuple[Console, int]) -> None:
    console, into = pipe
    for _ in range(10):
        os.write(into, b"x" * 4096)
        assert console.lines() == []
    os.write(into, b"\n\xff\xfe\n")
    long, strange = console.lines()
    assert len(long) == 1000
    assert strange == "��"
    os.close(into)


@given(
    st.lists(st.text(st.characters(codec="ascii", categories=["L", "N"]), min_size=1)), st.data()
)
def test_lines_come_whole_however_they_are_cut(lines: list[str], data: st.DataObject) -> None:
    out, into = os.pipe()
    console, got = Console(out), []
    rest = "".join(f"{line}\n" for line in lines).encode()
    while rest:
        size = data.draw(st.integers(1, len(rest)))
        os.write(into, rest[:size])
        rest = rest[size:]
        got += console.lines()
    os.close(into)
    got += console.lines()
    os.close(out)
    assert got == lines


def test_no_input_at_all_is_fine() -> None:
    with open(os.devnull, "rb") as nothing:
        console = Console(nothing.fileno())
        assert console.lines() == []
    assert console.lines() == []
    closed, into = os.pipe()
    os.close(closed)
    os.close(into)
    assert Console(closed).lines() == []


def test_a_process_in_a_terminals_background_does_not_read_from_it() -> None:
    master, terminal = os.openpty()
    console = Console(terminal)  # which is nobody's controlling terminal
    os.write(master, b"r1 off\n")
    assert console.lines() == []
    os.close(master)
    os.close(terminal)
