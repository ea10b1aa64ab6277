"""What a view costs a walk: the same walk with and without one that is looked at, in turns.

`python -m benchmarks.view` walks teams in lock-step over the bus, and prints by which share a view
slows down the second half of a walk, and how much of a core its process takes. Its page takes in
all that it is sent and draws nothing: a browser may run on any other computer.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import geometric_mean, median
from threading import Event, Thread
from typing import Any, Final

from rich.console import Console

from benchmarks.options import Options
from benchmarks.parts import team
from benchmarks.walks import over_the_bus
from quadriga.shared.errors import ProcessError, QuadrigaError
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.process_use import read_use
from quadriga.shared.runtime.signals import interrupt_on_sigterm
from quadriga.stop_times.view_watcher import ViewWatcher
from quadriga.tables import Table, print_tables
from quadriga.team.launch import QUADRIGA
from quadriga.team.run_folder import CONFIG
from quadriga.team.spectator import end_process
from quadriga.view.port import free_port
from quadriga.warm_up import warm_up

_INTERRUPTED: Final = 130
_LOOK_S: Final = 0.25
_COLUMNS: Final = ("robots", "pair", "without", "with", "ratio", "view, of a core", "kB/s")


@dataclass
class _Use:
    """Processor time of a view's process, by time of the clock, s, and bytes its page took in."""

    looks: list[tuple[float, float, int]] = field(default_factory=list)

    def of_second_half(self) -> tuple[float, float]:
        """Share of a core, and bytes a second, over the half in which the page is complete.

        Raises:
            ProcessError: the walk was over before that.
        """
        looks = self.looks[len(self.looks) // 2 :]
        if len(looks) < 2:
            raise ProcessError("its page", "nothing before the walk was over", "a longer walk")
        (begun, cpu, received), (ended, cpu_then, received_then) = looks[0], looks[-1]
        return (cpu_then - cpu) / (ended - begun), (received_then - received) / (ended - begun)


def main() -> int:
    """Walk, print; 0 if all walks could be walked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=5, help="of walks, of each team")
    parser.add_argument("--robots", type=int, nargs="+", default=[3, 10], metavar="N")
    parser.add_argument("--planner", default="distributed")
    parser.add_argument("--seconds", type=float, default=20.0, help="world time of a walk")
    parser.add_argument("--json", type=Path, metavar="FILE")
    given = parser.parse_args()
    if given.pairs < 1:
        parser.error(f"--pairs: got {given.pairs}, expected at least 1")
    if given.json is not None and not given.json.parent.is_dir():
        parser.error(f"--json: got {given.json}, expected a file in a folder that there is")
    interrupt_on_sigterm()
    console = Console(highlight=False)
    options = Options((), tuple(given.robots), given.seconds, given.planner, False, Path())
    try:
        rows = [
            row
            for robots in options.robots
            for row in _pairs(options, robots, given.pairs, console)
        ]
    except QuadrigaError as error:
        print(f"view: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return _INTERRUPTED
    print_tables([_table(rows)])
    figures = [_summary(rows, robots) for robots in options.robots]
    for team_figures in figures:
        console.print(_format_summary(team_figures), markup=False)
    if given.json is not None:
        text = json.dumps({"pairs": rows, "teams": figures}, indent=1)
        given.json.write_text(text + "\n", encoding="utf-8")
    return 0


def _pairs(options: Options, robots: int, pairs: int, console: Console) -> list[dict[str, Any]]:
    """Walks without and with a view in turns, so that a slow hour of the computer meets both."""
    config, file, predictor = team(options, robots, options.seconds, console)
    warm_up(config, console)
    rows = []
    for pair in range(pairs):
        factors, use = dict[str, float](), _Use()
        besides = {"without": {}, "with": {"beside": partial(_looked_at, use)}}
        for name in sorted(besides, reverse=pair % 2 == 0):
            with console.status(f"{robots} robots, pair {pair + 1} of {pairs}, {name} a view …"):
                walked = over_the_bus(config, file, predictor, lambda _: None, **besides[name])
            factors[name] = walked["rtf_half"]  # the page is complete by then
        core, received = use.of_second_half()
        rows.append({"robots": robots, "pair": pair, **factors, "core": core, "bytes_s": received})
    return rows


@contextmanager
def _looked_at(use: _Use, run: Path) -> Iterator[None]:
    """A view of the walk within the block, and a page that takes in what it sends."""
    port = free_port()
    with (run / "view.log").open("wb") as log:
        command = (*QUADRIGA, "view", "--port", str(port), "--config", str(run / CONFIG))
        process = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL)
    over = Event()
    try:
        with ViewWatcher(port) as page:

            def look() -> None:
                while not over.wait(_LOOK_S):
                    if (now := read_use(process.pid)) is not None and page.received:
                        use.looks.append((monotonic(), now.cpu_s, page.received))

            thread = Thread(target=look)
            thread.start()
            try:
                yield
            finally:
                over.set()
                thread.join()
    finally:
        end_process(process)


def _summary(rows: Sequence[dict[str, Any]], robots: int) -> dict[str, Any]:
    """Of one team's pairs: the real-time factor with a view over that without, a core's share."""
    own = [row for row in rows if row["robots"] == robots]
    ratios = [row["with"] / row["without"] for row in own]
    return {
        "robots": robots,
        "pairs": len(own),
        "ratio": geometric_mean(ratios),
        "least": min(ratios),
        "most": max(ratios),
        "core": median(row["core"] for row in own),
        "core_most": max(row["core"] for row in own),
    }


def _format_summary(figures: dict[str, Any]) -> str:
    return (
        f"{figures['robots']} robots: a walk with a view goes {figures['ratio']:.3f} times as fast "
        f"(geometric mean of {figures['pairs']} pairs, {figures['least']:.2f} to "
        f"{figures['most']:.2f}); the view takes {figures['core']:.1%} of a core, at most "
        f"{figures['core_most']:.1%}"
    )


def _table(rows: Sequence[dict[str, Any]]) -> Table:
    cells = [
        (
            str(row["robots"]),
            str(row["pair"] + 1),
            f"{row['without']:.2f}",
            f"{row['with']:.2f}",
            f"{row['with'] / row['without']:.3f}",
            f"{row['core']:.1%}",
            f"{1e-3 * row['bytes_s']:.0f}",
        )
        for row in rows
    ]
    return Table("real-time factor", _COLUMNS, tuple(cells))


if __name__ == "__main__":
    sys.exit(main())
