"""How a process begins and ends: what it waits for before it works, and what it leaves unsaid."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from quadriga.team.launch import QUADRIGA

# Each costs a process 0.1 to 0.5 s before it does anything; a team has six of them on two cores.
HEAVY = ("matplotlib", "mujoco", "numba", "osqp", "pinocchio", "scipy")


@pytest.mark.parametrize(
    ("module", "needed"),
    [
        ("quadriga.team.walk", ()),
        ("quadriga.team.operator", ()),
        ("quadriga.team.router", ()),
        ("quadriga.team.emergency_stop", ()),
        ("quadriga.recorder.process", ()),
        ("quadriga.plant.process", ("numba", "scipy")),
        ("quadriga.agents.process", ("numba", "osqp", "pinocchio", "scipy")),
    ],
)
def test_a_process_waits_for_no_library_that_it_does_not_need(
    module: str, needed: tuple[str, ...]
) -> None:
    code = f"import sys, quadriga.commands.parser, {module}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {*HEAVY} & {*done.stdout.split()} <= {*needed}


def test_what_was_said_has_been_written_when_the_process_ends(tmp_path: Path) -> None:
    file = tmp_path / "said"
    with file.open("wb") as out:
        done = subprocess.run([*QUADRIGA, "config", "--markdown"], stdout=out, check=False)
    assert done.returncode == 0
    assert file.read_text(encoding="utf-8").endswith("\n")
    assert file.stat().st_size > 20_000


def test_output_for_which_there_is_no_room_is_one_clear_line() -> None:
    code = "from quadriga.__main__ import end; print('said'); end(0)"
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [sys.executable, "-c", code],
            env={name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr == (
        "quadriga: the output: got No space left on device, expected room for it\n"
    )


def test_a_reader_that_has_left_is_no_error() -> None:
    with subprocess.Popen(
        [*QUADRIGA, "config"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0


WORKS = (
    "from quadriga.commands import parser; "
    "parser.main = lambda: [print(k, flush=True) for k in range(3)] and 7; "
    "from quadriga.__main__ import main; main()"
)


@pytest.mark.parametrize(("command", "status"), [("walk", 7), ("echo", 1)])
def test_what_has_more_to_do_than_to_print_goes_on_without_a_reader(
    command: str, status: int
) -> None:
    words = [sys.executable, "-c", WORKS, command]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout
        process.stdout.close()
    assert process.returncode == status


def test_a_terminal_may_lack_letters() -> None:
    written = {}
    for encoding in ("utf-8", "gbk", "iso-8859-1"):
        variables = {**os.environ, "PYTHONIOENCODING": encoding}
        done = subprocess.run(
            [*QUADRIGA, "config", "--markdown"], env=variables, capture_output=True, check=False
        )
        assert (done.returncode, done.stderr) == (0, b"")
        written[encoding] = done.stdout.decode(encoding)
    assert {len(text) for text in written.values()} == {len(written["utf-8"])}
    assert "≥" in written["utf-8"]
    assert "?" in written["iso-8859-1"]


def test_a_mistake_in_the_command_line_has_its_status() -> None:
    done = subprocess.run([*QUADRIGA, "walc"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "got 'walc', expected one that there is (did you mean 'walk'?)" in done.stderr
