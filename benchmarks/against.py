"""Whether this checkout is faster than an earlier commit, both measured in turns on one machine.

Run: python -m benchmarks.against COMMIT [PART ...] [--pairs 5] [--robots 1 3] [--json FILE]

A computer's speed changes from minute to minute, so figures of two days say little of each other.
Here both are measured one after the other, the earlier commit first in every other pair, and what
counts is the ratio within a pair. The commit is checked out in a folder that is removed at the end;
it takes the libraries that are installed, and compiles its machine code first, which takes minutes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import geometric_mean, median
from typing import Any, Final, NamedTuple

from rich.console import Console

from quadriga.shared.errors import ConfigError, ProcessError, QuadrigaError
from quadriga.shared.printable import printable_line
from quadriga.shared.runtime.signals import interrupt_on_sigterm
from quadriga.tables import Table, print_tables

_HERE: Final = Path(__file__).resolve().parents[1]
_INTERRUPTED: Final = 130
_NO_FIGURES: Final = ("machine", "quick", "parts", "failed", "seconds")
_PARTS: Final = ("low-level", "walks")
Figures = Mapping[str, float]


class FigureInTurns(NamedTuple):
    """A figure of two states of the code.

    Attributes:
        name: of the figure, `rtf.3` for example.
        before: of the earlier commit, of each pair.
        after: of this checkout.
    """

    name: str
    before: tuple[float, ...]
    after: tuple[float, ...]

    @property
    def ratios(self) -> list[float]:
        """After over before, of each pair."""
        return [a / b for b, a in zip(self.before, self.after, strict=True)]


def list_figures(result: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """The figures of a benchmark's JSON file that are above zero, by their path."""
    figures: dict[str, float] = {}
    for name, value in result.items():
        if not prefix and name in _NO_FIGURES:
            continue
        if isinstance(value, Mapping):
            figures |= list_figures(value, f"{prefix}{name}.")
        elif isinstance(value, int | float) and value > 0:
            figures[f"{prefix}{name}"] = float(value)
    return figures


def compare(pairs: Sequence[tuple[Figures, Figures]]) -> list[FigureInTurns]:
    """What both have measured in every pair (before, after)."""
    first, _ = pairs[0]
    names = [name for name in first if all(name in each for pair in pairs for each in pair)]
    return [
        FigureInTurns(name, tuple(b[name] for b, _ in pairs), tuple(a[name] for _, a in pairs))
        for name in names
    ]


def table(commit: str, comparisons: Sequence[FigureInTurns]) -> Table:
    """Medians, and the ratios within the pairs."""
    rows = tuple(
        (
            each.name,
            f"{median(each.before):.4g}",
            f"{median(each.after):.4g}",
            f"{geometric_mean(each.ratios):.3f}",
            f"{min(each.ratios):.3f} … {max(each.ratios):.3f}",
        )
        for each in comparisons
    )
    columns = ("figure", f"{commit}, median", "here, median", "here / there", "of all pairs")
    return Table("Against an earlier commit", columns, rows)


def main() -> int:
    """Measure in turns, print, write."""
    given = _parse()
    interrupt_on_sigterm()
    try:
        pairs = _measure(given, Console(stderr=True))
    except QuadrigaError as error:
        print(printable_line(f"benchmarks.against: {error}"), file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\ninterrupted; nothing was written", file=sys.stderr)
        return _INTERRUPTED
    comparisons = compare(pairs)
    print_tables([table(given.commit, comparisons)])
    if given.json is not None:
        rows = {each.name: {**each._asdict(), "ratios": each.ratios} for each in comparisons}
        given.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.against", description=__doc__.splitlines()[0]
    )
    parser.add_argument("commit", metavar="COMMIT", help="the earlier one")
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"({' '.join(_PARTS)})")
    parser.add_argument("--pairs", type=int, default=5, help="of measurements (%(default)s)")
    parser.add_argument("--robots", nargs="+", default=["1", "3"], help="sizes of the teams (1 3)")
    parser.add_argument("--seconds", default="4", help="length of each walk (%(default)s)")
    parser.add_argument("--planner", default="none", help="of the walks (%(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="all figures of all pairs")
    given = parser.parse_args()
    if given.pairs < 1:
        parser.error(f"--pairs: got {given.pairs}, expected 1 or more")
    return given


def _measure(given: argparse.Namespace, console: Console) -> list[tuple[Figures, Figures]]:
    words = [*(given.parts or _PARTS), "--planner", given.planner, "--seconds", given.seconds]
    words += ["--robots", *given.robots]
    pairs = []
    with _checked_out(given.commit) as there, console.status("…") as status:
        for tree in (there, _HERE):
            status.update(f"{tree.name}: compiled and run once, which does not count …")
            _run(tree, words)
        for number in range(given.pairs):
            order = (there, _HERE) if number % 2 == 0 else (_HERE, there)
            status.update(f"pair {number + 1} of {given.pairs} …")
            figures = {tree: _run(tree, words) for tree in order}
            pairs.append((figures[there], figures[_HERE]))
    return pairs


@contextmanager
def _checked_out(commit: str) -> Iterator[Path]:
    """A folder with a commit's files, while the block runs.

    Raises:
        ConfigError: there is no such commit.
    """
    with tempfile.TemporaryDirectory() as scratch:
        tree = Path(scratch, "earlier")
        command = ("git", "-C", str(_HERE), "worktree")
        added = subprocess.run(
            [*command, "add", "--detach", str(tree), commit],
            capture_output=True,
            text=True,
            check=False,
        )
        if added.returncode:
            said = (added.stderr.strip().splitlines() or ["nothing"])[-1]
            raise ConfigError("COMMIT", repr(commit), "a commit of this checkout", said)
        try:
            yield tree
        finally:
            subprocess.run([*command, "remove", "--force", str(tree)], check=False)


def _run(tree: Path, words: Sequence[str]) -> Figures:
    """One benchmark of the code in a folder.

    Raises:
        ProcessError: it failed.
    """
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch, "bench.json")
        done = subprocess.run(
            [sys.executable, "-m", "benchmarks", *words, "--out", str(out)],
            cwd=tree,
            env=os.environ | {"PYTHONPATH": str(tree)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            said = (done.stderr.strip().splitlines() or done.stdout.strip().splitlines())[-1:]
            got = f"status {done.returncode}: {''.join(said)}"
            raise ProcessError(f"benchmark in {tree}", got, "figures")
        return list_figures(json.loads(out.read_text(encoding="utf-8")))


if __name__ == "__main__":
    sys.exit(main())
