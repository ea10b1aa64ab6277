"""The page of published faults: `python -m quadriga.faults.page > docs/faults.md`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.faults.catalogue import build_meaning_tables
from quadriga.faults.goals import build_goal_table
from quadriga.faults.table import build_team_fault_tables
from quadriga.faults.teller import LEAD_MS
from quadriga.shared.config.load import load
from quadriga.team.run_folder import CONFIG
from quadriga.team.trial_rows import read_rows

PUBLISHED: Final = Path("docs/results/faults")
_NOTE: Final = "note.md"  # of a folder of rows, if it has one: with which code they were walked
_HEAD: Final = f"""\
# When something goes wrong

`quadriga fault NAME` walks a simulated team in which one thing goes wrong, 1.5 to 4 s into the
walk, at a robot and at a time that the seed draws, and tells what came of it. Sensors and motors
fail in lock-step, where the same seed gives the same walk; everything else in real time, with two
robots at most, since a computer must keep up. `quadriga fault --table --tries 20 --jobs 2` walks
with all of them, goes on where an earlier call with the same `--out` was stopped, and writes rows
with `--json`.

With `--at S` a fault comes S seconds into the walk, and `ROBOT/PART KIND` in place of its name says
whom it meets: `quadriga fault r2/agent killed --at 4`, `r2/link delay-50 --at 3 --for 1`,
`operator frozen --at 3`. Links take the words of sensors and motors, too, see the last table.

The recording of each walk has an event when the fault begins, and one when it ends, if it does:
those of sensors and motors on `sim/event`, all others on `injected`, in the name of the launcher
that makes them. The begin is told {LEAD_MS} ms before, so that it is recorded even where the
recorder is killed. No process of the team listens.

This page is generated from the configuration and the rows that are in a folder each of
`docs/results/faults`: `make docs`, or `python -m quadriga.faults.page > docs/faults.md`.
"""
_NONE: Final = "Nothing is published yet."


def to_markdown(published: Path = PUBLISHED) -> str:
    """The page, of all folders of rows in `published`."""
    parts = [_HEAD.rstrip()]
    folders = sorted(file.parent for file in published.glob(f"*/{CONFIG}"))
    for folder in folders:
        config, rows = load(folder / CONFIG), read_rows(folder)
        parts.append(
            f"## {folder.name}: {config.team.robots} robots, planner {config.planner.kind}"
        )
        if (folder / _NOTE).is_file():
            parts.append((folder / _NOTE).read_text(encoding="utf-8").strip())
        tables = (build_goal_table(config, rows), *build_team_fault_tables(rows))
        parts += [table.to_markdown(3).rstrip() for table in tables]
    if not folders:
        parts.append(_NONE)
    parts += [table.to_markdown().rstrip() for table in build_meaning_tables()]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    print(to_markdown(), end="")
