"""Every block of README and manual is run in a short form, or says why it is not.

One recorded run serves all commands that look into one, and one team those to a live one.
"""

from __future__ import annotations

import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from textwrap import indent
from typing import Any, Final

import pytest

from quadriga.commands.parser import main
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.places import SOURCE
from quadriga.team.operator import references_of
from tests.listening import WAIT, await_true
from tests.manual.blocks import (
    EXCERPT,
    LIVE,
    NOT_RUN,
    RUN_ELSEWHERE,
    SHORT,
    Block,
    all_blocks,
    split_commands,
)
from tests.manual.programs import read_command

RUN: Final = "RUN"  # what pages call a run folder
CONFIG: Final = "team.toml"  # and the reader's configuration, here that by default
ENDS: Final = ("stop",)  # the walk of the live team
FILTERS: Final = frozenset(("grep", "head"))  # of what a command says; what they find is not judged
BLOCKS: Final = [block for block in all_blocks() if block.page not in RUN_ELSEWHERE]
TYPED: Final = [b for b in BLOCKS if b.marker not in (NOT_RUN, EXCERPT) and b.said != LIVE]
LIVE_BLOCKS: Final = [block for block in BLOCKS if block.said == LIVE]
PAGES: Final = sorted({block.page for block in TYPED})
EXCERPTS: Final = [block for block in all_blocks() if block.marker == EXCERPT]
_WALK: Final = ("walk", "--no-report", "--no-view", "--set", "runtime.priority=ordinary")
# The team that `make prepared` collects for.
_PREPARED: Final = ("--robots", "2", "--set", "identification.seconds=60", "--seconds", "2")
_ALONE: Final = ("--robots", "1", "--planner", "none", "--seconds", "600")
_LIMIT: Final = 120.0  # s, far more than a short walk takes on a busy machine
WALKED: Final = 40  # ticks of a walk's short form
_LIVE_ONCE: Final = frozenset(("echo", "--watch"))  # go on until the walk is over, without -n
# Whose status tells how a team is, or what it did within seconds: a busy machine takes longer.
_JUDGES: Final = frozenset(("status", "stop", "resume"))
# Commands that are run as they are typed; the status of some tells what they found.
_LOOKING: Final = "doctor echo export info replay report"
_LISTING: Final = "completion config experiments fault"
_AS_TYPED: Final = frozenset((*_LOOKING.split(), *_LISTING.split(), "campaign", "certs"))
_FINDS: Final = frozenset(("doctor", "replay"))


@contextmanager
def walking(folder: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    """A team that is started and, should it still run, interrupted."""
    words = (sys.executable, "-m", "quadriga", *_WALK, *options, "--out", str(folder))
    log = folder.with_suffix(".log")
    with log.open("w", encoding="utf-8") as output:
        process = subprocess.Popen(words, stdout=output, stderr=subprocess.STDOUT, text=True)
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(_LIMIT)


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of two seconds of two robots in lock-step."""
    folder = tmp_path_factory.mktemp("manual") / "run"
    with walking(folder, *_PREPARED) as process:
        status = process.wait(_LIMIT)
    assert status == 0, folder.with_suffix(".log").read_text(encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def live_team(tmp_path_factory: pytest.TempPathFactory) -> Iterator[subprocess.Popen[str]]:
    """A robot that walks until somebody stops it."""
    folder = tmp_path_factory.mktemp("live") / "run"
    with walking(folder, *_ALONE) as process:
        yield process


def run_short(words: Sequence[str]) -> None:
    """Run a command of `quadriga` in its short form, in the present folder.

    Of a walk whose folder the page goes on with all is walked; of another some ticks.

    Raises:
        AssertionError: it has none, or it failed.
    """
    read = read_command(words)
    if read is None:
        return
    command, config, _ = read
    if command != "walk" or "--list" in words:
        assert command in (*_AS_TYPED, "walk"), (
            f"{command} has no short form: say why it is not run"
        )
        _run(words, (0, 1) if command in _FINDS else (0,))
    elif "--out" in words:
        _walk(words)
    else:
        _walk_some_ticks(config)


def run_live(words: Sequence[str]) -> None:
    """Run a command to a team that walks; one that would go on until its end, once."""
    once = ("-n", "1") if _LIVE_ONCE & {*words} and "-n" not in words else ()
    _run([*words, *once], (0, 1) if words[0] in _JUDGES else (0,))


def _walk_some_ticks(config: Config) -> None:
    """Build the world of a walk and step its agents in it, without a planner."""
    config = replace(config, planner=replace(config.planner, kind="none"))
    rollout = Rollout(config, None, references_of(config))
    for tick in rollout.ticks(WALKED):
        assert tick.outputs.keys() == rollout.agents.keys()
    assert rollout.world.tick == WALKED


def _run(words: Sequence[str], statuses: Sequence[int]) -> None:
    status = main(list(words))
    assert status in statuses, f"quadriga {' '.join(words)}: status {status}"


def _walk(words: Sequence[str]) -> None:
    command = (sys.executable, "-m", "quadriga", *words, "--no-view")
    done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=False)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"


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
                _run([*words, *shlex.split(block.said)], (0,))
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
