"""One trial as a worker process walks it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version

from agents.planner.store import versions
from quadriga.cache import trial_code
from quadriga.campaign.outcome import Outcome, outcome
from quadriga.campaign.plan import Group, seeded
from quadriga.campaign.predictors import Fitted
from quadriga.fit_report import reason
from quadriga.trial_job import walked
from shared.clock import monotonic
from shared.config import Config
from shared.config_text import config_sha256
from shared.errors import PredictorError, PredictorFileError, ProcessError
from shared.trace import trace_sha256


@dataclass(frozen=True, slots=True)
class Job:
    """A trial: its group's configuration, predictor and trace, and the code it is meant for."""

    group: Group
    seed: int
    config: Config
    fitted: Fitted
    versions: str
    trace_sha256: str = ""

    @property
    def name(self) -> str:
        """Of this trial alone."""
        return f"{self.group.name}-{self.seed}"


@lru_cache(maxsize=1)
def origin() -> str:
    """Code and libraries of this process, as every row names them."""
    more = {name: version(name) for name in ("numba", "example-robot-data")}
    found = {**versions(), **more, "code": trial_code()}
    return ", ".join(f"{name} {version}" for name, version in found.items())


def walk(job: Job) -> Outcome:
    """Walk a trial in this process, to its end or to the first fall.

    Raises:
        ProcessError: this process has other code, libraries or trace than the campaign.
        ConfigError: the configuration cannot be walked.
        PredictorFileError: the predictor's file, or that of its data, is gone or damaged.
    """
    mine = origin()
    if mine != job.versions:
        raise ProcessError("a worker's code and libraries", mine, job.versions,
                           "install the same version there")  # fmt: skip
    if trace_sha256(job.config) != job.trace_sha256:
        raise ProcessError("a worker's reference.trace", f"another {job.config.reference.trace}",
                           "the campaign's", "install the same version there")  # fmt: skip
    config, begun = seeded(job.config, job.seed), monotonic()
    try:
        found = job.fitted.refused or walked(config, job.fitted.path, job.fitted.data)
    except PredictorFileError:
        raise  # a row would be kept, and the trial never be walked
    except PredictorError as error:
        found = reason(error)
    shas = (config_sha256(config), job.fitted.sha256)
    return outcome(job.group, job.seed, shas, found, monotonic() - begun, mine)
