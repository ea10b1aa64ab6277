"""A topic that only these tests add is published, recorded, listed, exported and documented."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.write import to_toml
from quadriga.shared.members import SIM
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT, await_listener, await_recorded
from tests.plugins.kinds import install_package
from tests.plugins.wind.quadriga_wind import WIND, Wind

COUNT = 40


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Of processes that find the package installed, as these tests themselves do not."""
    path = install_package("wind", tmp_path_factory.mktemp("plugin"))
    return {**os.environ, "PYTHONPATH": path}


@pytest.fixture(scope="module")
def recording(environment: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Winds that went over a real bus into a recorder that is a process of its own."""
    folder = tmp_path_factory.mktemp("recorded")
    config = load(
        None, {"team.name": "band", "planner.kind": "none", "bus.endpoint": free_endpoint()}
    )
    (folder / "team.toml").write_text(to_toml(config), encoding="utf-8")
    file = folder / "run.mcap"
    command = ["record", "--now", "-o", str(file), "--config", str(folder / "team.toml")]
    with Bus.open(config.bus, config.team.name, SIM) as sim:
        sim.declare(HERE)
        put = sim.publisher(WIND.key("band"))
        recorder = subprocess.Popen([sys.executable, "-m", "quadriga", *command], env=environment)
        try:
            await_listener(sim, WIND.key("band"))
            for i in range(COUNT):
                tick = WIND.period_ms * i
                put(encode(Wind(tick, tick * 1_000_000, np.array([2.0, 0.5, i]), "mast")))
            await_recorded(file, COUNT)
        finally:
            recorder.terminate()
            assert recorder.wait(WAIT) == 0
    return file


def run(environment: dict[str, str], *arguments: str) -> str:
    """What a command says in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        timeout=WAIT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_it_is_recorded_with_its_schema(recording: Path) -> None:
    with recording.open("rb") as file:
        found = list(make_reader(file).iter_messages(topics=["band/wind"]))
    assert len(found) == COUNT
    schema, channel, message = found[-1]
    assert schema is not None
    assert (schema.name, channel.message_encoding) == ("quadriga.Wind", "msgpack")
    velocity = json.loads(schema.data)["properties"]["velocity"]
    assert (velocity["x-shape"], velocity["x-unit"], velocity["x-frame"]) == ([3], "m/s", "world")
    assert message.publish_time == WIND.period_ms * (COUNT - 1) * 1_000_000


def test_it_is_listed_and_shown(environment: dict[str, str], recording: Path) -> None:
    info = run(environment, "quadriga", "info", str(recording))
    row = next(line.split() for line in info.splitlines() if "band/wind" in line)
    assert row == ["band/wind", "Wind", str(COUNT), "10.0", "0", "3900", "0"]
    rates = run(environment, "quadriga", "hz", "wind", "--file", str(recording))
    assert rates.splitlines()[1].split()[:3] == ["band/wind", str(COUNT), "10.0"]
    echo = run(environment, "quadriga", "echo", "wind", "--file", str(recording)).splitlines()
    assert len(echo) == COUNT
    assert echo[3].split("band/wind  ")[1] == "velocity=[2 0.5 3] station='mast'"


def test_it_is_exported_with_the_names_of_its_entries(
    environment: dict[str, str], recording: Path, tmp_path: Path
) -> None:
    for kind, name in (("csv", "tables"), ("foxglove", "fox.mcap"), ("parquet", "columns")):
        out = str(tmp_path / name)
        run(environment, "quadriga", "export", str(recording), "--to", kind, "-o", out)
    with (tmp_path / "tables" / "wind.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert len(rows) == 1 + COUNT
    assert [name for name in rows[0] if "velocity" in name] == [
        "velocity.x", "velocity.y", "velocity.z",
    ]  # fmt: skip
    with (tmp_path / "fox.mcap").open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert any(topic.endswith("wind") for topic in topics)


def test_it_is_documented(environment: dict[str, str]) -> None:
    page = run(environment, "quadriga.shared.schema").splitlines()
    row = "| `wind` |  | [Wind](#wind) | anemometer |  | 100 ms | 1000 ms | yes |"
    assert row in page
    assert "| `velocity` | 3 | m/s | world |" in page


def test_without_the_package_its_recordings_are_still_read(recording: Path) -> None:
    info = run({**os.environ}, "quadriga", "info", str(recording))
    assert next(line.split()[1] for line in info.splitlines() if "band/wind" in line) == "–"
