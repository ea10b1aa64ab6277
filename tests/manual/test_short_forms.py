"""Every block of README and manual is run in a short form, or says why it is not."""

from __future__ import annotations

import shlex
import subprocess
from pathlib import Path
from textwrap import indent
from typing import Any, Final

import pytest

from quadriga.commands.parser import main
from quadriga.shared.runtime.places import SOURCE
from tests.listening import WAIT, await_true
from tests.manual.blocks import EXCERPT, LIVE, NOT_RUN, RUN_ELSEWHERE, SHORT, Block, all_blocks
from tests.manual.shell import split_commands
from tests.manual.short_forms import run_live, run_short, run_with

RUN: Final = "RUN"  # what pages call a run folder
CONFIG: Final = "team.toml"  # and the reader's configuration, here that by default
ENDS: Final = ("stop",)  # the walk of the live team
FILTERS: Final = frozenset(("grep", "head"))  # of what a command says; what they find is not judged
BLOCKS: Final = [block for block in all_blocks() if block.page not in RUN_ELSEWHERE]
TYPED: Final = [b for b in BLOCKS if b.marker not in (NOT_RUN, EXCERPT) and b.said != LIVE]
LIVE_BLOCKS: Final = [block for block in BLOCKS if block.said == LIVE]
PAGES: Final = sorted({block.page for block in TYPED})
EXCERPTS: Final = [block for block in all_blocks() if block.marker == EXCERPT]


def commands_of(block: Block) -> list[list[str]]:
    """The commands of this project in a block; it has no others."""
    commands = [words for words in split_commands(block.text) if words[0] not in FILTERS]
    for words in commands:
        assert words[0] == "quadriga", f"{block.name}: {words[0]} has no short form"
    return [words[1:] for words in commands]


@pytest.mark.nightly
@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page_run(
    page: str, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one folder, programs with the names of those before: a block finds what others left."""
    monkeypatch.chdir(tmp_path)
    if any(RUN in block.text for block in TYPED if block.page == page):
        (tmp_path / RUN).symlink_to(request.getfixturevalue("run_folder"))
    (tmp_path / CONFIG).touch()
    (tmp_path / "deploy").symlink_to(SOURCE / "deploy")
    names: dict[str, Any] = {"__name__": "manual"}
    for block in TYPED:
        if block.page != page:
            continue
        if block.language == "python":
            exec(compile(block.text, block.name, "exec"), names)
            continue
        for words in commands_of(block):
            if block.marker == SHORT:
                run_with(words, shlex.split(block.said))
            else:
                run_short(words)


@pytest.mark.nightly
def test_the_commands_to_a_live_team_run(
    live_team: subprocess.Popen[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """One after the other, as pages show them, and at last the one that ends the walk."""
    await_true(lambda: "walk" in _modes(capsys) or live_team.poll() is not None)
    assert live_team.poll() is None
    for words in dict.fromkeys(tuple(words) for b in LIVE_BLOCKS for words in commands_of(b)):
        if words != ENDS:
            run_live(words)
    run_live(ENDS)
    assert live_team.wait(WAIT) in (0, 1)


def _modes(capsys: pytest.CaptureFixture[str]) -> str:
    """What the robots of the team on this machine do, in words."""
    capsys.readouterr()
    main(["status", "--seconds-heard", "0.5"])
    return capsys.readouterr().out


@pytest.mark.parametrize("block", EXCERPTS, ids=lambda block: block.name)
def test_an_excerpt_stands_in_its_file(block: Block) -> None:
    """As it is, or as an item of a list."""
    text = (SOURCE / block.said).read_text(encoding="utf-8")
    assert block.text in text or indent(block.text.rstrip(), " " * 4) in text
