"""The messages of a tick by Zenoh's own implementation in C, beside both ways of the plant link.

`python -m benchmarks.zenoh_c DIR`, where zenoh-pico is installed in DIR (docs/benchmarks.md), tells
what a tick's messages cost without Python: `zenoh_c.c` sends and answers as many bytes between as
many processes, scheduled alike. It takes turns with `benchmarks.messaging`.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.messaging import measure
from quadriga.shared.link.packets import COMMAND_SIZE, HEADER, STATE_SIZE
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.signals import interrupt_on_sigterm
from quadriga.tables import Table, print_tables
from quadriga.team.endpoint import free_endpoint

SOURCE: Final = Path(__file__).with_suffix(".c")
WAYS: Final = ("bus", "zenoh-pico", "sockets")
_COLUMNS: Final = ("robots", "by", "median µs", "least and most of a turn", "as long as the bus")
_GRACE: Final = 10.0  # s
_INTERRUPTED: Final = 130


def main() -> int:
    """Build, take turns, print; 1 if zenoh-pico is not there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("prefix", type=Path, metavar="DIR", help="where zenoh-pico is installed")
    parser.add_argument("--robots", type=int, nargs="+", default=[1, 3, 5])
    parser.add_argument("--rounds", type=int, default=5, help="turns of each way")
    parser.add_argument("--ticks", type=int, default=4000, help="of a turn")
    given = parser.parse_args()
    interrupt_on_sigterm()
    try:
        with tempfile.TemporaryDirectory() as folder:
            program = build(given.prefix, Path(folder))
            rows = tuple(
                row
                for robots in given.robots
                for row in compare(program, robots, given.rounds, given.ticks)
            )
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"zenoh-pico in {given.prefix}: got {error}, expected a program", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return _INTERRUPTED
    print_tables([Table("The messages of a tick", _COLUMNS, rows)])
    return 0


def build(prefix: Path, folder: Path) -> Path:
    """The program, compiled against the library of a folder.

    Raises:
        OSError: there is no compiler.
        CalledProcessError: it has refused; it has said why.
    """
    program = folder / "zenoh_c"
    options = ["-std=gnu11", "-O3", "-Wall", f"-I{prefix / 'include'}", "-DZENOH_LINUX"]
    libraries = [f"-L{prefix / 'lib'}", "-lzenohpico", "-lpthread", "-lrt"]
    command = ["cc", *options, str(SOURCE), *libraries, "-o", str(program)]
    subprocess.run(command, check=True)
    return program


def compare(program: Path, robots: int, rounds: int, ticks: int) -> Iterator[tuple[str, ...]]:
    """A line for each way of the messages of so many robots, of several turns of each."""
    medians = np.zeros((rounds, len(WAYS)))
    for turn in range(rounds):
        ours = measure(robots, ticks)
        c = time_c(program, robots, ticks)
        medians[turn] = ours["bus"]["median"], c, ours["socket"]["median"]
        print(f"{robots} robots, turn {turn + 1} of {rounds}", file=sys.stderr, flush=True)
    shares = medians / medians[:, :1]
    for k, way in enumerate(WAYS):
        low, high = medians[:, k].min(), medians[:, k].max()
        share = float(np.exp(np.log(shares[:, k]).mean()))
        median = float(np.median(medians[:, k]))
        yield str(robots), way, f"{median:.0f}", f"{low:.0f} to {high:.0f}", f"{share:.2f}"


def time_c(program: Path, robots: int, ticks: int) -> float:
    """Median time of a tick's messages by the C program, µs.

    Raises:
        CalledProcessError: one of its processes has failed.
    """
    endpoint = free_endpoint()
    state, command = (str(HEADER.size + 8 * size) for size in (STATE_SIZE, COMMAND_SIZE))
    with ExitStack() as team:
        world = [str(program), "world", endpoint, str(robots), state, str(ticks)]
        sim = team.enter_context(_running(world))
        for name in robot_names(robots):
            robot = [str(program), "robot", endpoint, name, command]
            team.enter_context(_running(robot))
        said, _ = sim.communicate()
        if sim.returncode:
            raise subprocess.CalledProcessError(sim.returncode, world)
    return 1e-3 * float(np.median([int(line) for line in said.split()]))


@contextmanager
def _running(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    """A process that is told to leave by the end of its input, and killed if it does not."""
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
    try:
        yield process
    finally:
        if process.stdin is not None:
            process.stdin.close()
        try:
            process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


if __name__ == "__main__":
    sys.exit(main())
