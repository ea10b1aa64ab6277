"""One function per command; those of processes: process_verbs, of recordings: recording_verbs.

Each imports what it needs: a process should start fast.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version
from typing import Any

from rich.console import Console

from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_markdown, to_toml
from quadriga.shared.errors import ConfigError

Given = dict[str, Any]


def walk(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """The main job."""
    from quadriga.team.endpoint import free_endpoint
    from quadriga.team.run_folder import check_own_config
    from quadriga.team.walk import walk

    check_own_config(arguments.config, arguments.out)
    # Several walks on one machine are the rule; only who names an endpoint wants that one.
    if config.bus.mode == "peer" and "endpoint" not in given.get("bus", {}):
        config = replace(config, bus=replace(config.bus, endpoint=free_endpoint()))
    return walk(config, arguments.out, pictures=not arguments.no_render, console=Console())


def scenarios(_arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """The scenarios and what they are."""
    from rich.table import Table

    from quadriga.team.scenarios import description, names

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, style="bold")
    table.add_column()
    for name in names():
        table.add_row(name, description(name))
    Console().print(table)
    return 0


def report(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """What came of a recorded walk."""
    from quadriga.shared.recording.reader import Recording
    from quadriga.team.run_folder import report, report_file, went_wrong

    html = arguments.html
    if html is not None and html.suffix.lower() not in (".html", ".htm"):
        raise ConfigError(
            "--html", str(html), "a name that ends in .html", "a recording is never written over"
        )
    if arguments.run.is_file():
        summary = report_file(arguments.run, html, console=Console())
        Recording(arguments.run).require_whole()
    elif html is not None:
        raise ConfigError(
            "--html",
            str(html),
            "a recording's FILE before it",
            "a run folder's page is its report.html",
        )
    else:
        summary = report(arguments.run, pictures=not arguments.no_render, console=Console())
    return int(went_wrong(summary))


def play(arguments: argparse.Namespace, config: Config, given: Given) -> int:
    """A recording back on the bus."""
    from quadriga.playback.play import play
    from quadriga.playback.timeline import Timeline, parse_remap
    from quadriga.shared.recording.reader import Recording

    remaps = [parse_remap(text) for text in arguments.remap]
    recording = Recording(arguments.file)
    if "name" in given.get("team", {}):
        remaps.append((recording.metadata.get("team", ""), config.team.name))
    tape = Timeline(recording, arguments.topics, remaps, arguments.clock)
    play(
        config.bus,
        tape,
        Console(),
        rate=arguments.rate,
        start=arguments.start,
        loop=arguments.loop,
        paused=arguments.paused,
    )
    recording.require_whole()
    return 0


def resim(arguments: argparse.Namespace, _config: Config, given: Given) -> int:
    """The world of a recording once more, compared to the byte."""
    from quadriga.replay.resim_run import run
    from quadriga.shared.recording.reader import Recording

    _expect_no_options(given, "the recording's own configuration is used")
    equal = run(arguments.file, Console())
    Recording(arguments.file).require_whole()
    return int(not equal)


def export(arguments: argparse.Namespace, _config: Config, given: Given) -> int:
    """A recording in a format of others."""
    from quadriga.export.run import run
    from quadriga.shared.recording.reader import Recording

    _expect_no_options(given, "the recording's own configuration is used")
    run(arguments.file, arguments.to, arguments.output, Console())
    Recording(arguments.file).require_whole()
    return 0


def replay(arguments: argparse.Namespace, _config: Config, given: Given) -> int:
    """Recorded agents, run again; the configuration is the recording's, with `given` changed."""
    from quadriga.replay.run import break_in, replay
    from quadriga.replay.text import described
    from quadriga.shared.recording.reader import Recording

    path = arguments.file
    options = (given, arguments.predictor, arguments.out)
    if arguments.stop_at is not None:
        if arguments.all:
            raise ConfigError("--break", "--all", "--robot NAME", "one debugger, one robot")
        outcomes = [break_in(path, arguments.robot, *options, arguments.stop_at)]
    else:
        robots = () if arguments.all else (arguments.robot,)
        outcomes = replay(path, robots, *options, Console(stderr=True))
    for outcome in outcomes:
        print(described(outcome))
    Recording(path).require_whole()
    return int(any(outcome.failed for outcome in outcomes))


def collect(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Collect data unless there are some."""
    from quadriga.identification.cache import data_path
    from quadriga.identification.identify import ensure_data

    dataset = ensure_data(config, Console(stderr=True))
    seconds = sum(episode.samples for episode in dataset.training) / 100
    print(f"{data_path(config)}\n{len(dataset.training)} episodes, {seconds:.0f} s for the fit")
    return 0


def fit(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Fit a predictor unless there is one, and report on it; collect data unless there are some."""
    from quadriga.identification.fit import run

    print(run(config, Console(stderr=True), every=arguments.all))
    return 0


def compare(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Planners and predictors in the same worlds, on the same data."""
    from quadriga.experiments.compare import run
    from quadriga.experiments.trial.trials import Choice
    from quadriga.experiments.trial.variants import (
        PLANNERS,
        PREDICTORS,
        SCENARIOS,
        chosen,
        seeds_of,
    )
    from quadriga.team.run_folder import check_own_config, make_run_dir

    if arguments.jobs < 1:
        raise ConfigError("--jobs", str(arguments.jobs), "at least 1")
    choice = Choice(
        chosen("--planners", arguments.planners, PLANNERS),
        chosen("--predictors", arguments.predictors, PREDICTORS),
        chosen("--scenarios", arguments.scenarios, SCENARIOS),
        seeds_of("--seeds", arguments.seeds),
        arguments.product,
    )
    check_own_config(arguments.config, arguments.out)
    out = arguments.out or make_run_dir(None)
    run(config, choice, out, jobs=arguments.jobs, bus=arguments.bus, console=Console(stderr=True))
    return 0


def prepare(_arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Do beforehand what the first walk would have to wait for."""
    from quadriga.identification.identify import ensure_predictor
    from quadriga.warm_up import warm_up

    console = Console(stderr=True)
    warm_up(config, console)
    if config.planner.kind != "none":
        print(ensure_predictor(config, console))
    return 0


def _expect_no_options(given: Given, why: str) -> None:
    """Refuse configuration that would be ignored."""
    if given:
        names = [f"{section}.{key}" for section, keys in given.items() for key in keys]
        raise ConfigError("options", ", ".join(names), "none of the configuration", why)


def show_config(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """The configuration as TOML or Markdown."""
    print(to_markdown(config) if arguments.markdown else to_toml(config), end="")
    return 0


def version(_arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """The installed version."""
    try:
        print(f"quadriga {installed_version('quadriga')}")
    except PackageNotFoundError:
        print("quadriga, from a source folder that is not installed")
    return 0
