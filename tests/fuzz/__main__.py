"""Bytes of every kind of damage through everything that reads bytes of others.

`python -m tests.fuzz` reads 100,000 inputs of each kind and prints what became of them: how many
were refused, how long the slowest took, and by how much the process grew. Nothing but an error of
the project's tree may come of any of them.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from math import inf
from pathlib import Path

from tests.fuzz.run import fuzz
from tests.fuzz.targets import targets


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=100_000, help="of each kind")
    parser.add_argument("--seconds", type=float, default=inf, help="for each kind, at most")
    parser.add_argument("--only", default="", help="one kind")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, targets(Path(folder)) as known:
        for name, target in known.items():
            if arguments.only in ("", name):
                tally = fuzz(target, arguments.inputs, arguments.seed, arguments.seconds)
                print(f"{name}: {tally}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
