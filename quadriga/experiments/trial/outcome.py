"""What one trial came to, as a row of a table: numbers, and text without line breaks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

from quadriga.experiments.plan import Group
from quadriga.experiments.trial.figures_of_merit import Figures
from quadriga.recordings.traces import ERRORS


@dataclass(frozen=True, slots=True)
class TrialOutcome:
    """One row. None where the walk was too short for a steady part, or had no planner.

    Attributes:
        scenario, variant, swept, seed: which trial.
        config_sha256, predictor_sha256: what it was walked with; no predictor, no digest.
        refused: why it was not walked, if the predictor was refused.
        success: every robot walked to the end.
        fell: a robot fell; that ended the trial.
        time_to_fall_s, first_to_fall: when, and which robot.
        stopped: why robots stopped that did not fall.
        rmse_z … rmse_wz: over the steady part, all robots; m, m/s, rad, rad/s. `rmse_z` is by the
            world's truth over the terrain under the hips, `rmse_z_over_stance_feet` as
            the robots measure it.
        mean_vx: over the steady part, all robots, m/s.
        distance_m: length of the way, mean over the robots.
        energy_j: ∑ |τ q̇| dt of all motors over the whole walk.
        cost_of_transport: energy over weight (robots and payload) and distance.
        control_cost: mean of ‖y − y_des‖²_Q + ‖u − u_nominal‖²_R per sample and robot, the height
            over the stance feet.
        planner_ms_p50, planner_ms_p99, solves: of planning steps, wall time; the first of each
            process counts among the solves alone.
        plans: how many plans had which status.
        seconds: world time walked.
        wall_s: wall time it took.
        versions: of code and libraries.
    """

    scenario: str
    variant: str
    swept: tuple[str, ...]
    seed: int
    config_sha256: str
    predictor_sha256: str
    refused: str
    success: bool
    fell: bool
    time_to_fall_s: float | None
    first_to_fall: str
    stopped: str
    rmse_z: float | None
    rmse_z_over_stance_feet: float | None
    rmse_vx: float | None
    rmse_vy: float | None
    rmse_roll: float | None
    rmse_pitch: float | None
    rmse_wz: float | None
    mean_vx: float | None
    distance_m: float | None
    energy_j: float | None
    cost_of_transport: float | None
    control_cost: float | None
    planner_ms_p50: float | None
    planner_ms_p99: float | None
    solves: int
    plans: str
    seconds: float
    wall_s: float
    versions: str

    @property
    def group(self) -> Group:
        """The group that it is a trial of."""
        return Group(self.scenario, self.variant, self.swept)

    def rmse(self, error: str) -> float | None:
        """The RMSE of one of `ERRORS`."""
        value: float | None = getattr(self, _column(error))
        return value

    def count_plans(self) -> dict[str, int]:
        """How many plans had which status."""
        pairs = (part.rpartition("=") for part in self.plans.split(", ") if part)
        return {name: int(count) for name, _, count in pairs}


def _column(error: str) -> str:
    return f"rmse_{error.replace('-', '_')}"


_KINDS: Final = {f.name: str(f.type) for f in fields(TrialOutcome) if f.name != "swept"}
_NAMES: Final = tuple(_KINDS)


def build_outcome(
    group: Group,
    seed: int,
    shas: tuple[str, str],
    result: Figures | str,
    wall_s: float,
    versions: str,
) -> TrialOutcome:
    """The row of a trial.

    Args:
        group: of the trial.
        seed: of the trial.
        shas: digests of its configuration and of its predictor.
        result: its figures, or why it was refused.
        wall_s: how long it took.
        versions: of code and libraries.
    """
    cells: dict[str, Any] = {
        "scenario": group.scenario, "variant": group.variant, "swept": group.swept, "seed": seed,
        "config_sha256": shas[0], "predictor_sha256": shas[1], "wall_s": wall_s,
        "versions": versions,
    }  # fmt: skip
    if isinstance(result, str):
        cells |= dict.fromkeys(name for name, kind in _KINDS.items() if "None" in kind)
        return TrialOutcome(
            **cells,
            refused=_line(result),
            success=False,
            fell=False,
            first_to_fall="",
            stopped="",
            solves=0,
            plans="",
            seconds=0.0,
        )
    cells |= {_column(name): result.rmse[name] for name in ERRORS}
    first = min(result.fallen, key=lambda robot: result.fallen[robot], default="")
    return TrialOutcome(
        **cells,
        refused="",
        success=not (result.fallen or result.stopped),
        fell=bool(result.fallen),
        time_to_fall_s=result.fallen.get(first),
        first_to_fall=first,
        stopped=_line("; ".join(f"{robot}: {why}" for robot, why in result.stopped.items())),
        mean_vx=result.mean["vx"],
        distance_m=result.distance,
        energy_j=result.work,
        cost_of_transport=result.cost_of_transport,
        control_cost=result.cost,
        planner_ms_p50=result.planner_ms_median,
        planner_ms_p99=result.planner_ms_p99,
        solves=result.solves,
        plans=", ".join(f"{_status(name)}={count}" for name, count in result.plans.items()),
        seconds=result.seconds,
    )


def column_names(sweeps: Sequence[str]) -> list[str]:
    """Names of the columns of a campaign that sweeps these keys."""
    return [*_NAMES[:2], *sweeps, *_NAMES[2:]]


def to_cells(row: TrialOutcome) -> list[str]:
    """The row's cells, in the order of `column_names`; numbers to their last bit."""
    cells = [_text(getattr(row, name)) for name in _NAMES]
    return [*cells[:2], *row.swept, *cells[2:]]


def from_cells(cells: Sequence[str]) -> TrialOutcome:
    """The inverse of `to_cells`.

    Raises:
        ValueError: a cell is not what its column holds, or there are too few.
    """
    swept = len(cells) - len(_NAMES)
    if swept < 0:
        raise ValueError(f"{len(cells)} cells")
    mine = [*cells[:2], *cells[2 + swept :]]
    values = {name: _value(_KINDS[name], c) for name, c in zip(_NAMES, mine, strict=True)}
    row = TrialOutcome(swept=tuple(cells[2 : 2 + swept]), **values)
    row.count_plans()  # refuses what is no count
    return row


def to_columns(rows: Sequence[TrialOutcome], sweeps: Sequence[str]) -> Mapping[str, list[Any]]:
    """The whole table by column."""
    table: dict[str, list[Any]] = {name: [] for name in column_names(sweeps)}
    for row in rows:
        for name in _NAMES:
            table[name].append(getattr(row, name))
        for key, value in zip(sweeps, row.swept, strict=True):
            table[key].append(value)
    return table


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)


def _value(kind: str, cell: str) -> Any:
    if kind == "str":
        return cell
    if kind == "bool":
        if cell not in ("true", "false"):
            raise ValueError(f"{cell!r} for true or false")
        return cell == "true"
    if kind == "int":
        return int(cell)
    return None if "None" in kind and not cell else float(cell)


def _line(text: str) -> str:
    return " ".join(text.split())


def _status(text: str) -> str:
    """What a planner calls its plan, without the marks that stand between two of them."""
    return _line(text).replace(",", ";")
