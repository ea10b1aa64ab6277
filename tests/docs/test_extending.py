"""The commands of docs/extending.md do what the page says, section by section."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

import pytest

from quadriga.shared.runtime.places import SOURCE

_PAGE: Final = (SOURCE / "docs" / "extending.md").read_text(encoding="utf-8")
# A block behind a comment `<!-- not run: why -->` is left out.
_SHELL: Final = re.compile(r"(?<!-->\n)^```sh\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_LIMIT: Final = 300.0  # s, far more than any section takes on a busy machine
TYPED_ELSEWHERE: Final = {"A planner"}  # by tests/plugins/test_balance.py
SECTIONS: Final = {
    part.partition("\n")[0]: "".join(_SHELL.findall(part)) for part in _PAGE.split("\n## ")[1:]
}


def test_every_section_has_commands() -> None:
    assert {"A planner", "A plant", "A robot", "A terrain", "A topic"} <= SECTIONS.keys()
    assert all(SECTIONS.values())


@pytest.mark.parametrize("section", sorted(SECTIONS.keys() - TYPED_ELSEWHERE))
def test_the_commands_of_a_section_run(section: str, tmp_path: Path) -> None:
    """In a folder with what they name of the checkout, so that nothing is left in that."""
    shutil.copytree(SOURCE / "tests" / "plugins", tmp_path / "tests" / "plugins")
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    with subprocess.Popen(
        ["bash", "-euo", "pipefail", "-c", SECTIONS[section]],
        cwd=tmp_path,
        env={**os.environ, "PATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            said, complained = process.communicate(timeout=_LIMIT)
        finally:  # a section that fails half way leaves what it started in the background
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 0, f"{said[-2000:]}\n{complained[-4000:]}"
