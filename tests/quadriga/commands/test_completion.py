"""A real shell completes the command line by the script that is printed for it."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache

import pytest

from quadriga.commands.completed_words import list_commands
from quadriga.commands.completion_scripts import WRITERS
from quadriga.commands.parser import build_parser, main
from quadriga.team.scenarios import names

SHELLS = [
    pytest.param(
        shell,
        marks=pytest.mark.skipif(shutil.which(shell) is None, reason=f"no {shell} is installed"),
    )
    for shell in WRITERS
]


@cache
def script(shell: str) -> str:
    parsers = build_parser(everything=True).commands
    return WRITERS[shell](list_commands(parsers, {"--scenario": names(), "fault": ("all",)}))


def complete(*words: str) -> set[str]:
    """What bash would offer for the last word."""
    line = " ".join(f"'{word}'" for word in words)
    test = (
        f"{script('bash')}\nCOMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _quadriga\n"
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "-c", test], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("quadriga", "ech"), {"echo"}),
        (("quadriga", "re"), {"record", "recover", "replay", "report", "reset", "resume"}),
        (("quadriga", "walk", "--mo"), {"--mode"}),
        (("quadriga", "walk", "--ou"), {"--out"}),
        (("quadriga", "walk", "--mode", ""), {"lockstep", "realtime"}),
        (("quadriga", "sim", "--as", ""), {"a1", "go1", "go2"}),
        (("quadriga", "estop", "--scenario", "hard-p"), {"hard-payload", "hard-push"}),
        (("quadriga", "fault", ""), {"all"}),
        (("quadriga", "completion", ""), {"bash", "fish", "zsh"}),
        (("quadriga", "walk", "--robots", ""), set()),
        (("quadriga", "walk", "--parent"), set()),
        (("quadriga", "info", "pyproj"), {"pyproject.toml"}),
        (("quadriga", "walk", "--config", "pyproj"), {"pyproject.toml"}),
    ],
)
def test_bash_offers_what_can_stand_there(words: tuple[str, ...], offered: set[str]) -> None:
    assert complete(*words) == offered


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_is_one_of_its_shell(shell: str) -> None:
    done = subprocess.run([shell, "-n"], input=script(shell), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("shell", WRITERS)
def test_it_is_printed(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.startswith("#")
    for word in ("hard-push", "agent-killed", "paper", "terrain-height", "realtime"):
        assert word in out
