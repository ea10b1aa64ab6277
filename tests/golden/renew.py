"""Makes the golden recording anew, because the agents' behaviour was meant to change.

    python -m tests.golden.renew --reason "the planner keeps a margin to the friction cone"

The predictor stays the one in this folder unless `--fit` is given: a change of the fit is no change
of what an agent does with it.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer
from rich.console import Console

from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.store import predictor_sha256, save
from quadriga.identification.predictors import ensure_predictor
from quadriga.recordings.metadata import build_metadata
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load as load_config
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError, QuadrigaError, RecordingError
from quadriga.shared.recording.metadata import PROFILE
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.runtime.arithmetic import arithmetic
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.clock import wall_ns
from quadriga.shared.schema import json_schema
from quadriga.shared.topics import topic_of
from tests.golden import scenario
from tests.golden.compare import first_difference
from tests.golden.rerun import recorded, rerun

ARITHMETIC: Final = "arithmetic"  # key of the recording's metadata
_KEPT_BITS: Final = 9  # of each mantissa of G: what is below compresses badly and matters little
_CHUNK: Final = 4 << 20  # bytes; large chunks compress better


def main() -> int:
    """Renew the recording and write down why."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.golden.renew",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    doc = "what the agents do differently now, and why that is right"
    parser.add_argument("--reason", required=True, metavar="TEXT", help=doc)
    parser.add_argument("--fit", action="store_true", help="fit the predictor anew as well")
    arguments = parser.parse_args()
    reason = " ".join(arguments.reason.split())
    if not reason:
        parser.error("--reason: a change of behaviour must be stated")
    try:
        if arguments.fit:
            fit(scenario.PREDICTOR)
        renew(scenario.RECORDING, scenario.PREDICTOR)
    except QuadrigaError as error:
        print(f"golden: {error}", file=sys.stderr)
        return 1
    note(scenario.REASONS, reason)
    print(f"golden: {scenario.RECORDING} renewed; commit it together with {scenario.REASONS}")
    return 0


def fit(path: Path) -> None:
    """Fit the predictor and write it with less digits, which makes it a quarter of the size."""
    config = load_config(None, scenario.FITTED_FOR)
    fitted, provenance = load_checked(ensure_predictor(config, Console(stderr=True)), config)
    predictor = Predictor(fitted.meta, rounded(fitted.G))
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "plain.npz"
        save(plain, predictor, asdict(provenance))
        with np.load(plain, allow_pickle=False) as archive:
            # As float32, which holds these digits exactly; what is read from it is float64 again.
            np.savez_compressed(path, G=archive["G"].astype("<f4"), document=archive["document"])
    load_checked(path, config)


def rounded(values: Array) -> Array:
    """The same numbers with `_KEPT_BITS` bits of mantissa."""
    mantissa, exponent = np.frexp(values)
    kept: Array = np.ldexp(np.round(np.ldexp(mantissa, _KEPT_BITS)), exponent - _KEPT_BITS)
    return kept


def renew(to: Path, predictor_file: Path) -> None:
    """Walk, record, and make sure that the recording reproduces itself before it replaces the old.

    Raises:
        PredictorError: there is no predictor that the present code takes.
        RecordingError: the agents do not repeat themselves on this machine.
    """
    config = scenario.config()
    try:
        predictor, _ = load_checked(predictor_file, config)
    except PredictorError as error:
        raise PredictorError(error.name, error.got, error.expected, "try --fit") from None
    with atomic_write(to) as partial:
        write(partial, config, predictor)
        entries = list(Recording(partial).entries())
        for robot in robot_names(config.team.robots):
            old = recorded(entries, config, robot)
            if difference := first_difference(old, rerun(entries, config, robot, predictor)):
                raise RecordingError(
                    "the golden walk", str(difference), "agents that repeat themselves to the byte"
                )


def write(path: Path, config: Config, predictor: Predictor) -> None:
    """Record the golden walk; equal walks give equal files."""
    about = build_metadata(config, predictor_sha256(predictor))
    about[ARITHMETIC] = json.dumps(arithmetic())
    with path.open("wb") as file:
        writer = Writer(
            file,
            chunk_size=_CHUNK,
            compression=CompressionType.ZSTD,
            index_types=IndexType.ALL ^ IndexType.MESSAGE,
        )
        writer.start(PROFILE, "quadriga")
        writer.add_metadata(PROFILE, about)
        _write(writer, scenario.walk(config, predictor))
        writer.finish()


def _write(writer: Writer, sent: Iterable[scenario.Sent]) -> None:
    channels: dict[str, int] = {}
    for key, message in sent:
        if key not in channels:
            kind = topic_of(key)[0].type
            text = json.dumps(json_schema(kind), ensure_ascii=False)
            schema = writer.register_schema(
                f"{PROFILE}.{kind.__name__}", "jsonschema", text.encode()
            )
            channels[key] = writer.register_channel(key, "msgpack", schema)
        writer.add_message(channels[key], message.stamp_ns, encode(message), message.stamp_ns)


def note(reasons: Path, reason: str) -> None:
    """Append a reason to the list."""
    day = datetime.fromtimestamp(1e-9 * wall_ns(), UTC)
    with reasons.open("a", encoding="utf-8") as file:
        file.write(f"- {day:%Y-%m-%d}: {reason}\n")


if __name__ == "__main__":
    sys.exit(main())
