"""Every command that README and manual show can be typed: it exists, and has these options."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib import import_module

import pytest

from quadriga.shared.errors import QuadrigaError
from quadriga.shared.runtime.places import SOURCE
from tests.manual.blocks import Block, all_blocks, find_spans, list_pages, split_commands
from tests.manual.programs import check_command, check_mention, check_places, is_place

OURS = ("quadriga ", "make ", "python -m ")
BLOCKS = [block for block in all_blocks() if block.language == "sh"]


@pytest.fixture(autouse=True)
def _in_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(SOURCE)


def wrong_commands(blocks: list[Block]) -> Iterator[str]:
    """What is wrong with the commands of blocks, a line each."""
    for block in blocks:
        for words in split_commands(block.text):
            try:
                check_command(words)
            except (QuadrigaError, AssertionError, SystemExit) as error:
                yield f"{block.name}: {' '.join(words)}: {error}"


def test_each_command_can_be_typed() -> None:
    assert len(BLOCKS) > 60
    assert list(wrong_commands(BLOCKS)) == []


def wrong_mentions(text: str) -> Iterator[str]:
    """What is wrong with the commands and files that the prose of a page mentions, a line each."""
    for span in find_spans(text):
        try:
            if is_place(span):
                check_places(span)
            elif span.startswith(OURS):
                choice = "|" in span and " | " not in span  # of words, as in a usage line
                for words in [span.split()] if choice else split_commands(span):
                    check_mention(words)
        except (QuadrigaError, AssertionError) as error:
            yield f"{span}: {error}"


def test_each_command_and_file_that_prose_mentions_is_there() -> None:
    wrong = {page.name: list(wrong_mentions(page.read_text("utf-8"))) for page in list_pages()}
    assert {name: lines for name, lines in wrong.items() if lines} == {}


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("quadriga wlak", "got 'wlak'"),
        ("quadriga walk --robts 3", "--robts"),
        (".venv/bin/quadriga walk --scenario gravle-3", "gravle-3"),
        ("quadriga campaign flat --planners 'a:planner.knd=none'", "planner.knd"),
        ("quadriga experiments hrad", "hrad"),
        ("quadriga walk --config deploy/dekc.toml", "no file deploy/dekc.toml"),
        ("pip install -e '.[campain]'", "no extra campain"),
        ("quadriga config | grpe seed", "grpe"),
        ("make wlak", "no target wlak"),
        ("python -m quadriga.nothing", ""),
        ("docker compose exec operator quadriga estp", "estp"),
    ],
)
def test_a_command_that_there_is_not_is_found(line: str, error: str) -> None:
    found = list(wrong_commands([Block("page.md", 1, "sh", line)]))
    assert len(found) == 1
    assert error in found[0]


def test_what_programs_that_are_not_run_import_is_there() -> None:
    programs = [b for b in all_blocks() if b.language == "python" and b.marker == "not run"]
    assert programs
    for block in programs:
        for node in ast.walk(ast.parse(block.text, block.name)):
            if isinstance(node, ast.ImportFrom):
                module = import_module(str(node.module))
                assert [one.name for one in node.names if not hasattr(module, one.name)] == []
