"""The layout beside an export: it places each panel once, and they show what the export holds."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from quadriga.commands.parser import main
from quadriga.shared.robots.colours import robot_colour
from tests.quadriga.conftest import WriteRun, run_config
from tests.quadriga.export.test_foxglove_file import Topics, read

Content = dict[str, Any]


@pytest.fixture(scope="module")
def out(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("layout") / "walk.mcap"
    assert main(["export", str(file), "--to", "foxglove", "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def layout(out: Path) -> Content:
    content: Content = json.loads(out.with_name("walk.foxglove-layout.json").read_text("utf-8"))
    return content


@pytest.fixture(scope="module")
def topics(out: Path) -> Topics:
    return read(out)


def placed(node: Any, configs: Content) -> Iterator[str]:
    """All panels below a node, those in tabs too."""
    if isinstance(node, str):
        yield node
        for tab in configs[node].get("tabs", ()):
            yield from placed(tab["layout"], configs)
    else:
        assert 0 < node["splitPercentage"] < 100
        assert node["direction"] in ("row", "column")
        yield from placed(node["first"], configs)
        yield from placed(node["second"], configs)


def resolve(topics: Topics, path: str) -> list[Any]:
    """What a path of a plot finds in the messages of its topic."""
    topic, *parts = re.sub(r"\.@\w+$", "", path).split(".")
    found = []
    for _, message in topics[topic]:
        values = [message]
        for part in parts:
            name, index = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", part).groups()  # type: ignore[union-attr]
            values = [getattr(value, name) for value in values]
            if index is not None:
                values = [value[int(index)] for value in values if len(value) > int(index)]
        found += values
    return found


def test_every_panel_is_placed_once(layout: Content) -> None:
    names = list(placed(layout["layout"], layout["configById"]))
    assert sorted(names) == sorted(layout["configById"])
    kinds = {name.partition("!")[0] for name in names}
    assert kinds == {"3D", "Plot", "RosOut", "StateTransitions", "Tab"}


def test_every_curve_and_topic_is_in_the_export(layout: Content, topics: Topics) -> None:
    curves = 0
    for name, config in layout["configById"].items():
        for path in config.get("paths", ()):
            assert resolve(topics, path["value"]), path["value"]
            curves += 1
        if name.startswith("3D"):
            assert set(config["topics"]) <= topics.keys()
            links = {frame.child_frame_id for frame in topics["/frames"][0][1].transforms}
            assert config["followTf"] in links
        if name.startswith("RosOut"):
            assert config["topicToRender"] in topics
    assert curves > 40


def test_what_is_true_of_a_robot_has_its_colour(layout: Content) -> None:
    for config in layout["configById"].values():
        for path in config.get("paths", ()):
            owner = re.match(r"/r(\d)/tracking\.true|/sim/truth\.r(\d)", path["value"])
            if owner:
                index = int(owner[1] or owner[2]) - 1
                assert path["color"] == robot_colour(index)


def test_angles_are_shown_in_degrees(layout: Content) -> None:
    plots = [c for c in layout["configById"].values() if "°" in c.get("foxglovePanelTitle", "")]
    assert len(plots) == 2 * 3
    assert all(p["value"].endswith(".@rad2deg") for plot in plots for p in plot["paths"])


def test_the_command_says_where_it_is_and_overwrites_none(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "a.foxglove-layout.json"
    kept.write_text("mine")
    arguments = ["export", str(file), "--to", "foxglove", "-o", str(tmp_path / "a.foxglove.mcap")]
    assert main(arguments) == 2
    assert f"{kept}, which exists" in capsys.readouterr().err
    assert kept.read_text() == "mine"
    assert not (tmp_path / "a.foxglove.mcap").exists()
    kept.unlink()
    assert main(arguments) == 0
    assert f"{kept}, its layout: Layouts > Import from file" in capsys.readouterr().out


def test_without_truth_there_is_no_scene(write_run: WriteRun, tmp_path: Path) -> None:
    lose: Callable[..., Any] = lambda key, m: None if key == "team/sim/truth" else m  # noqa: E731
    folder, out = write_run(run_config(1, 0.5), change=lose), tmp_path / "out.mcap"
    assert main(["export", str(folder / "run.mcap"), "--to", "foxglove", "-o", str(out)]) == 0
    layout = json.loads(out.with_name("out.foxglove-layout.json").read_text("utf-8"))
    assert not [name for name in layout["configById"] if name.startswith("3D")]
    assert "/sim/truth" not in json.dumps(layout)
