"""The benchmark on one page: what plans, ticks, messages, fits and walks cost.

Run: python -m benchmarks [PART ...] [--robots 1 2 3 5 10] [--seconds 4] [--out FILE]

Prints a page and writes FILE (JSON). Each part is measured with real processes and real walks on
this machine. Other programs change the figures, so run none. For a team that has not walked here
before, data are collected and a predictor is fitted first, which takes minutes for ten robots;
`--planner none` walks without a predictor. `--quick` only shows that all parts work.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from benchmarks import blas_threads
from benchmarks.parts import PARTS, Options, add_prefix
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.planner_kinds import BUILT_IN
from quadriga.shared.runtime.clock import monotonic, wall_ns
from quadriga.shared.runtime.signals import interrupt_on_sigterm

_VERSIONS = ("eclipse-zenoh", "numpy", "numba", "pin", "mujoco")
INTERRUPTED = 130


def main() -> int:
    """Measure, print and write; 0 if every part could be measured."""
    interrupt_on_sigterm()
    try:
        return run_parts(parse_options())
    except KeyboardInterrupt:
        print("\ninterrupted; nothing was written", file=sys.stderr)
        return INTERRUPTED


def run_parts(options: Options) -> int:
    """Run every part in turn, then build the page."""
    from rich.console import Console

    from benchmarks.page import headline, section, targets

    console = Console(width=120, highlight=False)
    result: dict[str, Any] = {"machine": describe_machine(), "quick": options.quick}
    begun, parts, failed = monotonic(), {}, {}
    console.print(section("machine", result["machine"]))
    for name in options.parts:
        with console.status(f"{name} …") as status:
            try:
                parts[name] = PARTS[name](options, console, add_prefix(status.update, name))
            except (QuadrigaError, ChildProcessError) as error:
                failed[name] = str(error)
        if name in parts:
            console.print(section(name, parts[name]))
        else:
            console.print(f"{name}: {failed[name]}", style="red", markup=False)
    figures = headline(parts)
    result |= {**figures, "parts": parts, "failed": failed, "seconds": monotonic() - begun}
    options.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if not options.quick:
        console.print(targets(figures))
    console.print(f"{options.out}; {result['seconds']:.0f} s", markup=False)
    return int(bool(failed))


def describe_machine() -> dict[str, Any]:
    """The machine's properties that the figures depend on."""
    from benchmarks.children import result_of
    from quadriga.shared.config.sections import Config
    from quadriga.shared.runtime.arithmetic import processor
    from quadriga.shared.runtime.scheduling import take_priority

    realtime = result_of(
        take_priority, Config().runtime.priority
    )  # what this process starts would inherit it
    return {
        "date": datetime.fromtimestamp(1e-9 * wall_ns(), UTC).isoformat(timespec="seconds"),
        "cores": len(os.sched_getaffinity(0)),
        "processor": processor(),
        "python": platform.python_version(),
        **{name: version(name) for name in _VERSIONS},
        "scheduling": "realtime" if realtime else "ordinary",
        "blas_threads": blas_threads.THREADS,
        "load": os.getloadavg()[0],
    }


def parse_options(words: Sequence[str] | None = None) -> Options:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__.splitlines()[0]
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)} (all)")
    parser.add_argument(
        "--robots",
        type=int,
        nargs="+",
        default=[1, 2, 3, 5, 10],
        help="sizes of the teams that walk",
    )
    parser.add_argument("--seconds", type=float, default=4.0, help="length of each walk")
    parser.add_argument("--seed", type=int, default=1, help="of the worlds of the part planner")
    parser.add_argument(
        "--planner",
        default="distributed",
        help="of the walks (%(default)s)",
        choices=[name for name, kind in BUILT_IN.items() if not kind.central],
    )
    parser.add_argument("--quick", action="store_true", help="all parts, too short to mean much")
    parser.add_argument("--out", type=Path, default=Path("runs/bench.json"), metavar="FILE")
    given = parser.parse_args(words)
    if unknown := sorted(set(given.parts) - PARTS.keys()):
        parser.error(f"no part {', '.join(unknown)}; there are {', '.join(PARTS)}")
    if min(given.robots) < 1 or given.seconds < 1.0:
        parser.error("a walk takes at least one robot and one second")
    folder = given.out.parent  # checked now, not after minutes of measuring
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"--out {given.out}: {error.strerror}; expected a folder that can be made")
    if given.out.is_dir() or not os.access(folder, os.W_OK):
        parser.error(f"--out {given.out}: expected a file that can be written")
    chosen = tuple(name for name in PARTS if name in given.parts or not given.parts)
    return Options(**vars(given) | {"parts": chosen, "robots": tuple(given.robots)})


if __name__ == "__main__":
    sys.exit(main())
