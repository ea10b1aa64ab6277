"""What certificates cost a walk in real time: three ways of the same messages, in turns.

`python -m benchmarks.certificates` walks two robots directly with each other, through a router
without certificates, and through one with them, and prints for each walk the real-time factor, the
late commands, the messages that the recording lacks and how much of a core the router took.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from benchmarks.realtime import late_commands
from quadriga.certs.folder import secure
from quadriga.identification.predictors import ensure_predictor
from quadriga.recordings.summary import summarise
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.members import ROUTER
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.runtime.clock import monotonic, utc_now
from quadriga.shared.runtime.process_use import read_use
from quadriga.shared.runtime.signals import interrupt_on_sigterm
from quadriga.tables import Table, print_tables
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table, router_row
from quadriga.team.run_folder import CONFIG
from quadriga.warm_up import warm_up

WAYS: Final = ("directly", "router", "router with certificates")
_INTERRUPTED: Final = 130
_GRACE: Final = 30.0  # s, for a router to see that its team has left
_FIGURES: Final = ("real-time factor", "late %", "oldest command ms", "lost messages")
_COLUMNS: Final = ("seed", "way", *_FIGURES, "router, of a core", "fell", "end")


def main() -> int:
    """Walk, print; 0 if all walks could be walked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--walks", type=int, default=3, help="of each way")
    parser.add_argument("--robots", type=int, default=2)
    parser.add_argument("--planner", default="distributed")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=0, help="of the first world")
    given = parser.parse_args()
    interrupt_on_sigterm()
    keys = {
        "team.robots": given.robots,
        "world.mode": "realtime",
        "world.duration": given.seconds,
        "planner.kind": given.planner,
    }
    console = Console(highlight=False)
    try:
        config = load(None, keys)
        warm_up(config, console)
        predictor = None
        if find_kind(config.planner.kind).needs_predictor:
            predictor = ensure_predictor(config, console)
        rows = []
        for seed in range(given.seed, given.seed + given.walks):
            seeded = replace(config, world=replace(config.world, seed=seed))
            for way in WAYS:
                with console.status(f"seed {seed}, {way} …"):
                    rows.append((str(seed), way, *walk_once(seeded, way, predictor)))
    except QuadrigaError as error:
        print(f"certificates: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return _INTERRUPTED
    print_tables([Table("What certificates cost", _COLUMNS, tuple(rows))])
    return 0


def walk_once(config: Config, way: str, predictor: Path | None) -> tuple[str, ...]:
    """Walk, and what came of it: the cells behind seed and way.

    Args:
        config: in real time; its endpoint is replaced by a free one.
        way: one of `WAYS`.
        predictor: its file; None without one.

    Raises:
        ProcessError: a process failed or left too early.
    """
    with _way_of(config, way) as (ready, folder):
        (folder / CONFIG).write_text(to_toml(ready), encoding="utf-8")
        rows = process_table(ready, folder, predictor, "")
        if way != WAYS[0]:
            router = router_row(ready, folder)
            rows = (replace(router, command=(*router.command, "--once"), grace=_GRACE), *rows)
        begun, used = monotonic(), 0.0
        with Launch(rows, folder / "logs") as launch:

            def look() -> bool:
                nonlocal used
                use = read_use(launch.pids[ROUTER]) if ROUTER in launch.pids else None
                used = used if use is None else use.cpu_s
                return False

            launch.watch(look)
        share = used / (monotonic() - begun)
        return _cells(summarise(folder), config, share if way != WAYS[0] else None)


@contextmanager
def _way_of(config: Config, way: str) -> Iterator[tuple[Config, Path]]:
    with tempfile.TemporaryDirectory() as scratch:
        folder, certificates = Path(scratch, "run"), Path(scratch, "certs")
        folder.mkdir()
        mode = config.bus.mode if way == WAYS[0] else "client"
        ready = replace(config, bus=replace(config.bus, endpoint=free_endpoint(), mode=mode))
        yield (secure(ready, certificates, utc_now()) if way == WAYS[2] else ready), folder


def _cells(summary: dict[str, Any], config: Config, router: float | None) -> tuple[str, ...]:
    walk = late_commands(summary, config)
    return (
        f"{walk['rtf']:.2f}",
        f"{100.0 * walk['late_share']:.1f}",
        f"{walk['oldest_ms']:.0f}",
        f"{walk['gaps']:,}",
        "–" if router is None else f"{router:.2f}",
        ", ".join(walk["fallen"]) or "nobody",
        walk["end"],
    )


if __name__ == "__main__":
    sys.exit(main())
