"""Bytes of every kind of damage through everything that reads bytes of others.

`python -m tests.fuzz` reads 100,000 inputs of each kind and prints what became of them: how many
were refused, how long the slowest took, and by how much the process grew. Nothing but an error of
the project's tree may come of any of them, none may take long, and memory must not grow: else the
exit status is 1, and a line says which input of which kind it was.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import inf
from pathlib import Path
from typing import Any, Final

from tests.fuzz.run import Limits, fuzz
from tests.fuzz.targets import KINDS, targets

_IN_MEMORY: Final = "/dev/shm"  # where there is one, so that no disk slows the reading of files
_MOST_MEMORY: Final = 8 << 30  # bytes of addresses: what asks for more must not stop the machine


def main(words: Sequence[str]) -> int:
    """Fuzz as the words of a command line say; 1 if anything is not as it must be."""
    arguments = _parse(words)
    limits = Limits(arguments.limit_ms, arguments.limit_mb)
    figures: dict[str, Mapping[str, Any]] = {}
    wrong = 0
    memory = _IN_MEMORY if os.access(_IN_MEMORY, os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as folder, targets(Path(folder)) as build:
        for name in arguments.only or KINDS:
            tally = fuzz(
                build(name), arguments.inputs, arguments.seed, arguments.seconds, arguments.first
            )
            print(f"{name}: {tally}", flush=True)
            complaints = tally.complaints(limits)
            for line in complaints:
                print(f"{name}: {line}", file=sys.stderr, flush=True)
            wrong += len(complaints)
            figures[name] = {"first": arguments.first, **asdict(tally), "complaints": complaints}
            if arguments.json is not None:
                _write(arguments.json, arguments.seed, limits, figures)
    return 1 if wrong else 0


def _parse(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=100_000, help="of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument("--seconds", type=float, default=inf, help="for each kind, at most")
    parser.add_argument("--only", action="append", choices=KINDS, help="a kind; may be repeated")
    parser.add_argument("--seed", type=int, default=0)
    usual = Limits()
    parser.add_argument(
        "--limit-ms", type=float, default=usual.input_ms, help="processor time of an input"
    )
    parser.add_argument(
        "--limit-mb", type=float, default=usual.grown_mb, help="growth over all inputs of a kind"
    )
    parser.add_argument("--json", type=Path, help="file for the figures")
    return parser.parse_args(words)


def _bound_memory() -> None:
    """Have what asks for more memory than anything here needs be refused by the system."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_MEMORY, hard))


def _write(path: Path, seed: int, limits: Limits, figures: Mapping[str, Any]) -> None:
    body = {"seed": seed, "limits": asdict(limits), "kinds": figures}
    path.write_text(json.dumps(body, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    _bound_memory()
    sys.exit(main(sys.argv[1:]))
