"""Time of a plan on a real walk: the paper's problems as written there, against ours.

Run: python -m benchmarks.planner [--robots 3 5] [--seconds 4] [--seed 1] [--out FILE]

Every contender solves every planning step of the same walks, one after the other within each step,
in one process with one BLAS thread. Times are processor times, so other programs do not count. "as
written" is sparse OSQP with its own tolerances, one object warm-started from step to step. Errors
are against OSQP at 1e-9 on the condensed problem; the gap is relative to the plan's improvement on
nominal forces.
"""

from __future__ import annotations

from benchmarks import blas_threads  # before numpy

# isort: split
import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import thread_time
from typing import Any, Protocol

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import sparse

from benchmarks.as_written import TIGHT, WarmOsqp
from benchmarks.page import targets
from benchmarks.planner_contenders import (
    AS_WRITTEN,
    Case,
    Contender,
    Local,
    Team,
    TeamDeepc,
    is_at_bound,
)
from benchmarks.planner_ticks import PlanningTick, record
from quadriga.agents.planner.qp import PlannerProblem
from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.predictors import ensure_data, ensure_predictor
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array

# Limits of the figures at n = 5.
TARGETS = (
    ("ratio_median", ">=", 40.0), ("ratio_p99", ">=", 40.0), ("tick_ratio_median", ">=", 40.0),
    ("tick_ratio_p99", ">=", 40.0), ("constrained_ratio_p99", ">=", 40.0),
    ("central_ratio_median", ">=", 50.0), ("applied_force_error_n", "<=", 0.01),
    ("relative_gap", "<=", 1e-6),
)  # fmt: skip
# What differs from the default world; a team that is pushed plans at its bounds.
WALKS: Sequence[Mapping[str, Any]] = (
    {},
    {"terrain": "boxes"},
    {"push_force": 150.0, "push_every": 0.5},
)
# The paper has one transition matrix for all of the gait, and plans that keep nothing of the last
# ones nor bring their peers' forward. Such a team need pass no gate of ours to be timed.
AS_IN_THE_PAPER: Mapping[str, Any] = {
    "identification.predictor": "ridge",
    "identification.max_peers_harm": 1000.0,
    "identification.max_radius": 10.0,
    "planner.damping": 0.0,
    "planner.compensation": False,
}
SEED = 1
TEAM_STEPS = 12  # per walk; as written the problem of 5 robots takes most of a second
DEEPC_STEPS = {1: 20, 3: 2}  # per walk; as written: 0.3 s for one robot, many for three
HEADINGS = (
    "n",
    "problem",
    "how",
    "plans",
    "median ms",
    "p99 ms",
    "× median",
    "× p99",
    "cone N",
    "force N",
    "gap",
    "at a bound",
    "median ms",
    "p99 ms",
    "× p99",
)


Row = dict[str, float | str | None]


class Formulation(Protocol):
    """One problem with its contenders."""

    def cases(self, tick: PlanningTick) -> list[Case]:
        """The plans of one step."""
        ...

    def contenders(self) -> list[Contender]:
        """Fresh contenders."""
        ...


def main() -> None:
    """Measure, print and write."""
    options = arguments()
    console = Console(width=120)
    rows: list[Row] = []
    for robots in options.robots:
        config, predictor, walks = record_walks(robots, options.seconds, console, options.seed)
        rows += measure(config, Local(config, predictor), walks)
        team = [walk[-TEAM_STEPS:] for walk in walks]
        rows += measure(config, Team(config, predictor), team)
    for robots in options.deepc:
        rows += deepc(robots, options, console)
    figures = headline(rows)
    console.print(table(rows))
    console.print(targets(figures, TARGETS))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(
        json.dumps({**figures, "blas_threads": blas_threads.THREADS, "rows": rows}, indent=2) + "\n"
    )


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=[3, 5])
    parser.add_argument("--deepc", type=int, nargs="*", default=[1, 3], help="team sizes for eq. 5")
    parser.add_argument("--seconds", type=float, default=4.0, help="length of each walk")
    parser.add_argument("--seed", type=int, default=SEED, help="of the walks' worlds")
    parser.add_argument("--out", type=Path, default=Path("runs/bench-planner.json"))
    return parser.parse_args()


def record_walks(
    robots: int, seconds: float, console: Console, seed: int = SEED
) -> tuple[Config, Predictor, list[list[PlanningTick]]]:
    """A team, its predictor, and the planning steps of its walks."""
    world = {"world.duration": seconds, "world.seed": seed}
    config = load(None, {"team.robots": robots, **world, **AS_IN_THE_PAPER})
    predictor = load_checked(ensure_predictor(config, console), config)[0]
    worlds = [replace(config.world, **changes) for changes in WALKS]
    return config, predictor, [record(replace(config, world=w), predictor) for w in worlds]


def deepc(robots: int, options: argparse.Namespace, console: Console) -> list[Row]:
    """Eq. 5 for a team of this size."""
    config, _, walks = record_walks(robots, options.seconds, console, options.seed)
    episodes = ensure_data(config, console).training
    last = [walk[-DEEPC_STEPS.get(robots, 1) :] for walk in walks]
    return measure(config, TeamDeepc(config, episodes), last)


def measure(
    config: Config, formulation: Formulation, walks: Sequence[Sequence[PlanningTick]]
) -> list[Row]:
    """Run every contender on every case, another one first each time; one row per contender."""
    contenders = formulation.contenders()
    cases = [case for walk in walks for tick in walk for case in formulation.cases(tick)]
    bound: list[bool] = []
    for case in formulation.cases(walks[0][0]):
        for contender in contenders:
            contender.run(case)  # the first call includes the set-up
    for turn, case in enumerate(cases):
        exact = reference(case.problem, case.f)
        bound.append(is_at_bound(case.problem, exact))
        for place in range(len(contenders)):
            contender = contenders[(place + turn) % len(contenders)]
            begun = thread_time()
            u = contender.run(case)
            contender.times.append(thread_time() - begun)
            contender.errors.append(judge(config, case, exact, u))
    yardstick = {c.problem: c for c in contenders if c.name == AS_WRITTEN}
    return [row(config.team.robots, c, yardstick[c.problem], bound) for c in contenders]


def reference(problem: PlannerProblem, f: Array) -> Array:
    """The minimiser by OSQP at 1e-9."""
    A = sparse.csc_array(np.vstack([np.eye(len(f)), problem.A]))
    solver = WarmOsqp(sparse.csc_array(np.triu(problem.H)), A, TIGHT)
    x, status, _ = solver.solve(f, problem.lower, problem.upper)
    if status != "solved":
        raise RuntimeError(f"the reference did not converge: {status}")
    return x


def judge(config: Config, case: Case, exact: Array, u: Array) -> tuple[float, float, float]:
    """Violation of the cone [N], force error on the applied samples [N], gap of the objective."""
    robots, problem = list(case.robots), case.problem
    stance, nominal = case.tick.stance[robots], case.tick.nominal[robots]
    best = np.zeros(u.size)
    best[problem.columns] = exact
    error = np.abs(u - best).reshape(nominal.shape)[:, : config.planner.applied]

    def objective(v: Array) -> float:
        return float(0.5 * v @ problem.H @ v + case.f @ v)

    least = objective(exact)
    gap = abs(objective(u[problem.columns]) - least) / abs(least)
    force = (nominal + u.reshape(nominal.shape)).reshape(*stance.shape, 3)
    fx, fy, fz = np.moveaxis(force, -1, 0)
    c = config.planner.mu / np.sqrt(2.0)
    beyond = np.maximum.reduce([np.abs(fx) - c * fz, np.abs(fy) - c * fz, -fz])
    violation = np.where(stance, np.maximum(beyond, 0.0), np.abs(force).max(axis=-1))
    return float(violation.max()), float(error.max()), gap


def row(robots: int, contender: Contender, yardstick: Contender, bound: Sequence[bool]) -> Row:
    """Figures of a contender, of its plans at a bound too; ratios are yardstick over contender."""
    (median, p99), (slow, slow_p99) = (
        1e3 * np.percentile(c.times, (50, 99)) for c in (contender, yardstick)
    )
    cone, force, gap = np.max(contender.errors, axis=0)
    held: list[float | None] = [None, None, None]
    if any(bound):
        (own, own_p99), (_, other_p99) = (
            1e3 * np.percentile(np.array(c.times)[bound], (50, 99)) for c in (contender, yardstick)
        )
        held = [float(own), float(own_p99), float(other_p99 / own_p99)]
    values = (robots, contender.problem, contender.name, len(contender.times), float(median),
              float(p99), float(slow / median), float(slow_p99 / p99),
              float(cone), float(force), float(gap), sum(bound), *held)  # fmt: skip
    keys = (
        "robots",
        "problem",
        "name",
        "plans",
        "median_ms",
        "p99_ms",
        "ratio_median",
        "ratio_p99",
        "cone_violation_n",
        "applied_force_error_n",
        "relative_gap",
        "constrained",
        "constrained_median_ms",
        "constrained_p99_ms",
        "constrained_ratio_p99",
    )
    return dict(zip(keys, values, strict=True))


def headline(rows: Sequence[Row]) -> dict[str, float | None]:
    """The figures that have a limit, of the default solver at n = 5."""
    by_problem = {r["problem"]: r for r in rows if r["robots"] == 5 and r["name"] == "daqp"}
    wanted = {
        "ratio_median": ("eq. 12, QP", "ratio_median"), "ratio_p99": ("eq. 12, QP", "ratio_p99"),
        "tick_ratio_median": ("eq. 12, tick", "ratio_median"),
        "tick_ratio_p99": ("eq. 12, tick", "ratio_p99"),
        "constrained_ratio_p99": ("eq. 12, tick", "constrained_ratio_p99"),
        "central_ratio_median": ("eq. 7", "ratio_median"),
        "applied_force_error_n": ("eq. 12, QP", "applied_force_error_n"),
        "relative_gap": ("eq. 12, QP", "relative_gap"),
    }  # fmt: skip
    found = {key: by_problem.get(row, {}).get(figure) for key, (row, figure) in wanted.items()}
    return {key: None if value is None else float(value) for key, value in found.items()}


def table(rows: Sequence[Row]) -> Table:
    """All rows, for people."""
    shown = Table(*HEADINGS)
    for values in rows:
        cells = [
            "–" if v is None else v if isinstance(v, str) else f"{v:.3g}" for v in values.values()
        ]
        shown.add_row(*cells)
    return shown


if __name__ == "__main__":
    main()
