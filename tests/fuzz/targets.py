"""What is fuzzed: each makes inputs, and reads one as this project would."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np

from tests.fuzz import arrays, campaigns, certificates, configurations, messages, recordings, walks
from tests.fuzz.target import Target

KINDS: Final[Mapping[str, Callable[[Path], Target]]] = {
    "messages": lambda _: messages.Messages(),
    "answers": lambda _: messages.Answers(),
    "orders": lambda _: messages.Orders(),
    "drivers": lambda _: messages.Drivers(),
    "operator-answers": messages.OperatorAnswers,
    "configurations": configurations.Configurations,
    "experiments": configurations.experiments,
    "tunings": configurations.tunings,
    "variants": configurations.variants,
    "reference-traces": configurations.reference_traces,
    "manifests": campaigns.manifests,
    "trials": campaigns.trials,
    "ledgers": campaigns.ledgers,
    "packs": campaigns.Packs,
    "json-rows": campaigns.json_rows,
    "predictors": arrays.predictors,
    "datasets": arrays.datasets,
    "pulse-responses": arrays.measured_responses,
    "repetitions": arrays.repetitions,
    "saved-programs": arrays.saved_programs,
    "certificates": certificates.Certificates,
    "authorities": lambda _: certificates.Authorities(),
    "recordings": recordings.Recordings,
    "traces": walks.traces,
    "exports": walks.exports,
    "replays": walks.replays,
    "realtime-replays": walks.realtime_replays,
}


@contextmanager
def targets(folder: Path) -> Iterator[Callable[[str], Target]]:
    """Within the block a function that builds one by its name; its files are in `folder`."""

    def build(name: str) -> Target:
        own = folder / name
        own.mkdir()
        return KINDS[name](own)

    with np.errstate(all="ignore"):
        yield build
