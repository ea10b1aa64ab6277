"""A run as a campaign's trial: its figures of merit, and the world that it was walked in."""

from __future__ import annotations

import json
from dataclasses import asdict
from hashlib import sha256
from typing import Final

from quadriga.api.run import Run
from quadriga.experiments.plan import Group
from quadriga.experiments.trial.figures_of_merit import compute_figures
from quadriga.experiments.trial.outcome import TrialOutcome, build_outcome
from quadriga.experiments.trial.over_bus import read_walk
from quadriga.recordings.metadata import recorded_versions
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.recording.reader import Recording

# Of the team what its world depends on.
_TEAM: Final = ("robots", "robot", "yokes", "spacing", "plant", "plant_per_robot")


def build_trial(run: Run) -> TrialOutcome:
    """The trial that a run is.

    Raises:
        RecordingError: the run holds no walk.
    """
    config, figures = run.config, compute_figures(read_walk(run.path))
    world = config.world.scenario or config.world.terrain
    group = Group(world, "", (_digest_world(config),))
    metadata = Recording(run.path).metadata
    shas = config_sha256(config), metadata.get("predictor_sha256", "")
    versions = ", ".join(f"{name} {of}" for name, of in recorded_versions(metadata).items())
    return build_outcome(group, config.world.seed, shas, figures, 0.0, versions)


def _digest_world(config: Config) -> str:
    """Digest of the world but for its seed: equal ones are one world."""
    team, world = asdict(config.team), asdict(config.world)
    del world["seed"]
    text = json.dumps([{key: team[key] for key in _TEAM}, world], sort_keys=True)
    return sha256(text.encode()).hexdigest()[:12]
