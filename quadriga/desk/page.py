"""The page of published walks on the desk: `python -m quadriga.desk.page > docs/desk.md`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.desk.faults import BY_NAME, FAULTS, NO_FAULT
from quadriga.desk.tables import build_fault_table, build_walk_table
from quadriga.desk.trial import WITHOUT
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.registry import ROBOTS
from quadriga.tables import Table
from quadriga.team.run_folder import CONFIG
from quadriga.team.trial_rows import read_rows

PUBLISHED: Final = Path("docs/results/desk")
_HEAD: Final = """\
# Walks on the desk

What simulated robots did that were reached through bridges and their own protocols, in real time:
`quadriga desk` walked, with the configuration and the rows that are in a folder each of
`docs/results/desk`. This page is generated: `python -m quadriga.desk.page > docs/desk.md`.

A computer of two cores had to be the robots and the team. Walks were made one at a time, with the
kernel's throttling of real-time processes switched off (`kernel.sched_rt_runtime_us = -1`), which
else stops a bridge for 50 ms when a core is full; Linux 6.18 does so all the same.

"""
_WALK_NOTE: Final = """\
Figures are means over robots and walks from the fourth second on; where a row says "no bridges",
the same seeds walked in the simulated world itself, in real time. "answer" is the time from the
arrival of a report to the command that the agent made of it: the median of the walks' medians, the
worst p99 and the worst of all; without bridges, the age of a command in whole milliseconds. "late
%" is the share of ticks at which the motors followed a command of an earlier tick. "too slow" are
walks in which the simulated robots kept less than 99 % of real time, which no real one does: they
are left out of all else."""
_FAULT_NOTE: Final = """\
Each fault came at a random moment 2 to 4 s into a walk, at one robot, and was tried until 20 tries
counted. "no walk": a robot was stopped before the fault came, by its own bridge or by its
neighbour's, or the team did not begin; its row has the reason, most often that a bridge or an agent
was late on the full computer. "walked on": to the end of the walk; "lay down": its bridge folded
the legs; "damped": its motors were damped or off without that, and "ms to damping" tells how long
after the fault; "still driven": nobody could reach the motors any more. "fell": its trunk was
tilted by more than 0.8 rad. The last word is that of most tries. An A1 says nothing of its battery,
and over UDP nobody tells of a second writer: its bridge cannot see these two."""


def to_markdown(published: Path = PUBLISHED) -> str:
    """The page, of all folders of rows in `published`."""
    folders = sorted(path.parent for path in published.glob(f"*/{CONFIG}"))
    walks, faults = list[Table](), list[Table]()
    for folder in folders:
        rows, title = read_rows(folder), describe(load(folder / CONFIG))
        if any(row["fault"] in (NO_FAULT.name, WITHOUT) for row in rows):
            walks.append(build_walk_table(rows, f"{title}: "))
        if any(row["fault"] in BY_NAME for row in rows):
            table = build_fault_table(rows)
            faults.append(Table(f"Faults: {title}", table.columns, table.rows))
    parts = [_HEAD.rstrip()]
    if walks:
        lines = tuple(row for table in walks for row in table.rows)
        parts.append(Table("Walks", walks[0].columns, lines, [_WALK_NOTE]).to_markdown().rstrip())
    parts += [table.to_markdown().rstrip() for table in faults]
    if faults:
        meanings = tuple((fault.name, fault.what) for fault in FAULTS)
        parts += [
            _FAULT_NOTE,
            Table("What the faults are", ("fault", "what"), meanings).to_markdown(),
        ]
    return "\n\n".join(parts).rstrip() + "\n"


def describe(config: Config) -> str:
    """Robots, ground and planner of a configuration, in a few words."""
    kind, n, world = ROBOTS[config.team.robot].title, config.team.robots, config.world
    ground = "flat"
    if world.terrain != "flat":
        ground = f"{world.terrain} of {100 * world.terrain_height:g} cm"
    return f"{n} {kind}, {ground}, planner {config.planner.kind}"


if __name__ == "__main__":
    print(to_markdown(), end="")
