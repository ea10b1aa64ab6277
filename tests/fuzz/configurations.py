"""Texts that people write: configurations, experiments, traces of references."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, cast

import numpy as np

from quadriga.experiments.published.experiment_file import read_experiment
from quadriga.shared.config.load import load
from quadriga.shared.config.reference_trace import ROW_END, inline_trace, trace_of
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.reader import Recording
from tests.fuzz.damage import damage
from tests.fuzz.target import VALUES, Reader, change_toml, file_reader

_DEPLOY: Final = Path(__file__).parents[2] / "deploy"


class Configurations:
    """Files of a configuration, and the configurations of recordings."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "team.toml"
        self._keys: dict[str, list[str]] = {}
        for line in to_toml(load()).splitlines():
            if line.startswith("["):
                section = self._keys.setdefault(line, [])
            elif "=" in line and not line.startswith("#"):
                section.append(line)

    def make(self, random: np.random.Generator) -> bytes:
        lines = []
        for section in random.permutation(list(self._keys))[: random.integers(1, 4)]:
            lines.append(section)
            for key in random.permutation(self._keys[section])[: random.integers(1, 5)]:
                name, _, value = str(key).partition(" = ")
                if random.random() < 0.5:
                    value = VALUES[int(random.integers(len(VALUES)))]
                lines.append(f"{name} = {value}")
        text = "\n".join(lines).encode()
        return text if random.random() < 0.5 else damage(text, random)

    def read(self, content: bytes) -> None:
        self._path.write_bytes(content)
        with suppress(QuadrigaError):
            text = content.decode("utf-8", "replace")
            text = json.dumps({"world": {"seed": text}}) if len(text) % 2 else text
            recorded: Any = SimpleNamespace(path=self._path, metadata={"config_json": text})
            recorded_config(cast(Recording, recorded))
        to_toml(load(self._path))


def toml_files(path: Path, good: list[Path], reads: Callable[[Path], object]) -> Reader:
    """Files that say what is walked."""
    return file_reader(path, [file.read_bytes() for file in good], reads, change_toml)


def experiments(folder: Path) -> Reader:
    """Files of experiments."""
    good = sorted((_DEPLOY / "experiments").glob("*.toml"))
    return toml_files(folder / "mine.toml", good, read_experiment)


def reference_traces(folder: Path) -> Reader:
    """Courses of the velocity reference, in files and in configurations."""
    good = (_DEPLOY / "scenarios" / "joystick.csv").read_bytes()
    short = b"".join(good.splitlines(keepends=True)[:12])

    def read(path: Path) -> None:
        line = inline_trace(str(path))
        if ROW_END in line and line.isprintable():
            trace = trace_of(load(None, {"reference.trace": line}))
            assert trace is not None
            assert np.isfinite(trace.at(1e6)).all()

    return file_reader(folder / "trace.csv", (good, short, short), read)
