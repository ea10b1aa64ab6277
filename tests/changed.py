"""Prints the tests of what was changed since the last commit, or in it: `make check` runs them."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Final

TOP: Final = Path(__file__).parents[1]


def changed_files() -> list[Path]:
    """Files that differ from the last commit; of an unchanged checkout those of that commit."""
    new = _ask_git("diff", "--name-only", "HEAD") + _ask_git("ls-files", "-o", "--exclude-standard")
    return [Path(line) for line in new or _ask_git("show", "--name-only", "--format=", "HEAD")]


def _ask_git(*words: str) -> list[str]:
    git = ("git", *words)
    done = subprocess.run(git, cwd=TOP, check=True, capture_output=True, text=True)
    return done.stdout.splitlines()


def find_tests(changed: Path) -> list[Path]:
    """The test file of a module, else all of the folder that has the tests of its package."""
    if changed.suffix != ".py" or not changed.parts[:-1]:
        return []
    if changed.parts[0] == "tests":
        own, folder = changed, changed.parent
    else:
        folder = Path("tests") / changed.parent
        own = folder / f"test_{changed.name}"
    if own.name.startswith("test_") and (TOP / own).is_file():
        return [own]
    return sorted(path.relative_to(TOP) for path in (TOP / folder).glob("test_*.py"))


if __name__ == "__main__":
    print(*sorted({test for changed in changed_files() for test in find_tests(changed)}))
