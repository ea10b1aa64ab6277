"""Statistics of paired trials: two variants in the same worlds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from quadriga.api.run import Run
from quadriga.api.run_trial import build_trial
from quadriga.experiments.campaign.ledger import read_manifest, read_rows
from quadriga.experiments.measures import format_p
from quadriga.experiments.results import Ratio
from quadriga.experiments.statistics import Pairs, mcnemar, paired_difference
from quadriga.experiments.summarise import compare_with_baseline
from quadriga.experiments.trial.outcome import TrialOutcome
from quadriga.shared.errors import ConfigError

Trials = str | Path | Sequence[TrialOutcome | Run]
"""A campaign's folder of one variant, some of its trials, or runs of a script's own."""


@dataclass(frozen=True, slots=True)
class PairedComparison:
    """The first of two variants beside the second one, over pairs of the same world and seed.

    Attributes:
        pairs: how many.
        falls: of the pairs in how many a robot fell in `both`, in the `first` alone, in the
            `second` alone, in `neither`.
        p: of McNemar's exact two-sided test that both fall as often.
        fall_difference: share of falls of the first less that of the second, and the ends of
            Newcombe's 95 % interval.
        upright: pairs in which all robots walked to the end in both.
        ratios: of these, the first over the second: of the control cost (`cost`) and of the RMSE of
            z, z-over-stance-feet, vx, vy, roll, pitch, wz. Each has the number of `pairs`, the
            `median`, and `low` and `high`, the ends of its exact 95 % interval; None where there
            are too few, fewer than six for the interval.
    """

    pairs: int
    falls: Pairs
    p: float
    fall_difference: tuple[float, float, float]
    upright: int
    ratios: Mapping[str, Ratio]

    def __str__(self) -> str:
        """In a few lines."""
        value, low, high = self.fall_difference
        lines = [
            f"{self.pairs} pairs: {self.falls.both} with falls in both, {self.falls.first} in the "
            f"first alone, {self.falls.second} in the second alone; McNemar's p {format_p(self.p)}",
            f"share of falls, first less second: {value:+.3f} [{low:+.3f}, {high:+.3f}]",
            f"first over second, {self.upright} pairs that walked to the end:",
        ]
        for name, ratio in self.ratios.items():
            if ratio.median is not None:
                ends = ""
                if ratio.low is not None and ratio.high is not None:
                    ends = f" [{ratio.low:.3f}, {ratio.high:.3f}]"
                lines.append(f"  {name} {ratio.median:.3f}{ends}")
        return "\n".join(lines)


def read_trials(folder: str | Path) -> dict[str, tuple[TrialOutcome, ...]]:
    """The trials of a campaign that are walked, by variant.

    Example:
        >>> trials = quadriga.read_trials("runs/campaign")
        >>> print(quadriga.compare_paired(trials["distributed"], trials["none"]))

    Args:
        folder: of a campaign (`quadriga campaign --out`).

    Returns:
        Of each variant a row for each trial, whose fields are the columns of trials.csv, such as
        `seed`, `fell`, `rmse_vx` [m/s] and `planner_ms_p99`.

    Raises:
        ConfigError: the folder is no campaign's, or of another version.
    """
    manifest = read_manifest(Path(folder))
    rows = read_rows(Path(folder), manifest)
    return {name: tuple(r for r in rows if r.variant == name) for name in manifest.variants}


def compare_paired(a: Trials, b: Trials) -> PairedComparison:
    """What two variants came to in the same worlds, with the statistics of `quadriga campaign`.

    Trials are pairs if their world and their seed are the same; others are left out. Of runs the
    world is the size, kind and yokes of the team and all that the section `world` says.

    Example:
        >>> none = {"planner.kind": "none"}
        >>> a = [quadriga.walk("hard-blocks", seed=k) for k in range(8)]
        >>> b = [quadriga.walk("hard-blocks", seed=k, set=none) for k in range(8)]
        >>> print(quadriga.compare_paired(a, b))

    Args:
        a: trials of `read_trials`, runs of `quadriga.walk` or `quadriga.open`, or the folder of a
            campaign of one variant.
        b: likewise: what `a` is compared with.

    Raises:
        ConfigError: there is no pair; a folder is no campaign's, or has several variants.
        RecordingError: a run holds no walk.
    """
    beside = compare_with_baseline(_list_trials(a), _list_trials(b))
    if beside is None:
        got, expected = "no trial of the same world and seed in both", "at least one pair"
        raise ConfigError("compare_paired", got, expected)
    return PairedComparison(
        pairs=beside.fell.total,
        falls=beside.fell,
        p=mcnemar(beside.fell),
        fall_difference=paired_difference(beside.fell),
        upright=beside.upright,
        ratios=beside.ratios,
    )


def _list_trials(given: Trials) -> list[TrialOutcome]:
    if isinstance(given, str | Path):
        trials = read_trials(given)
        if len(trials) != 1:
            got = f"the variants {', '.join(trials)}"
            cause = "read_trials(folder)[name] chooses one"
            raise ConfigError(str(given), got, "a campaign of one variant", cause)
        return list(next(iter(trials.values())))
    return [build_trial(one) if isinstance(one, Run) else one for one in given]
