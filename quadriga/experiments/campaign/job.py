"""One trial as a worker process walks it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from quadriga.experiments.plan import Group, with_seed
from quadriga.experiments.predictors import Fitted
from quadriga.experiments.trial.evaluate import evaluate
from quadriga.experiments.trial.figures_of_merit import Figures
from quadriga.experiments.trial.origin import code_and_libraries, foreign_origin, is_same_code
from quadriga.experiments.trial.outcome import TrialOutcome, build_outcome
from quadriga.identification.predictors import reason
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import PredictorError, PredictorFileError, ProcessError
from quadriga.shared.runtime.clock import monotonic


@dataclass(frozen=True, slots=True)
class TrialJob:
    """A trial: its group's configuration and predictor, and the code it is meant for.

    `plugin` is the package that its planner comes with, or the controller of one's own that walks,
    see `foreign_origin`; "" for the project's own.
    """

    group: Group
    seed: int
    config: Config
    fitted: Fitted
    versions: str
    plugin: str = ""

    @property
    def name(self) -> str:
        """Of this trial alone."""
        return f"{self.group.name}-{self.seed}"


def walk_trial(
    job: TrialJob, walk: Callable[[Config, Fitted], Figures] | None = None
) -> TrialOutcome:
    """Walk a trial to its end or to the first fall, in this process unless `walk` does it.

    Raises:
        ProcessError: this process has other code, libraries or planner than the campaign.
        ConfigError: the configuration cannot be walked.
        PredictorFileError: the predictor's file, or that of its data, is gone or damaged.
    """
    mine = code_and_libraries()
    if not is_same_code(mine, job.versions):
        raise ProcessError(
            "a worker's code and libraries", mine, job.versions, "install the same version there"
        )
    plugin = foreign_origin(job.config)
    if plugin != job.plugin:
        raise ProcessError(
            "a worker's planner or controller",
            plugin or "a built-in one",
            job.plugin or "a built-in one",
            "install the same version there",
        )
    config, begun = with_seed(job.config, job.seed), monotonic()
    try:
        result = job.fitted.refused or (walk or _evaluate)(config, job.fitted)
    except PredictorFileError:
        raise  # a row would be kept, and the trial never be walked
    except PredictorError as error:
        result = reason(error)
    shas = (config_sha256(config), job.fitted.sha256)
    return build_outcome(job.group, job.seed, shas, result, monotonic() - begun, job.versions)


def _evaluate(config: Config, fitted: Fitted) -> Figures:
    return evaluate(config, fitted.path, fitted.data)
