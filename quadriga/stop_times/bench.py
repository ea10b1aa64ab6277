"""SHELL of stopping teams many times, in each way: who walks, when it is stopped, what is kept."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from rich.console import Console

from quadriga.agents.predictor.store import predictor_sha256
from quadriga.drive.client import ControlLink, socket_path
from quadriga.drive.driver_words import WHERE
from quadriga.drive.wish import standing
from quadriga.identification.predictors import ensure_predictor
from quadriga.shared.config.sections import BY_HAND, Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import BusError, ProcessError
from quadriga.shared.members import OPERATOR
from quadriga.shared.modes import ESTOP, STAND
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.places import runtime_dir
from quadriga.stop_times.figures import StopPress, find_stops
from quadriga.stop_times.page_driver import PageDriver
from quadriga.stop_times.stop_listener import read_heard, stop_listener
from quadriga.stop_times.view_watcher import ViewWatcher
from quadriga.stop_times.ways import STANDS, WAYS
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table
from quadriga.team.run_folder import CONFIG
from quadriga.team.spectator import view_beside
from quadriga.team.trial_rows import append_row, open_rows
from quadriga.view.port import free_port
from quadriga.warm_up import warm_up

_HEARD: Final = "heard.txt"  # of a walk: what its agents and plant said of themselves, and when
_BLOCK: Final = 10  # presses in one walk
_SPEED: Final = 0.3  # m/s forward, while it walks
_EARLIEST_S, _LATEST_S = 0.5, 1.5  # from the time at which all walk until the press
_START_S: Final = 120.0  # for a team to start
_STOP_S: Final = 5.0  # for it to stop
_FOREVER: Final = 3600.0  # s, more than a walk lasts


class _Predictor(NamedTuple):
    file: Path | None
    sha256: str


def time_stops(
    config: Config, ways: Sequence[str], tries: int, folder: Path, console: Console
) -> list[dict[str, Any]]:
    """Stop teams until each way has as many tries; what is in the folder already counts.

    Args:
        config: of a simulated world.
        ways: of `WAYS`.
        tries: of each.
        folder: gets the file of rows, and a folder for each walk.
        console: told of each walk.

    Returns:
        All rows of the folder: way, ms until the team had stopped (null: it had not), walk.

    Raises:
        ConfigError: the folder cannot be written to, or holds tries of another configuration.
        ProcessError: a team did not start, or did not walk again.
    """
    driven = replace(config.reference, driver=BY_HAND, page_port=0)
    world = replace(config.world, duration=_FOREVER)
    config = replace(config, reference=driven, world=world)
    rows = open_rows(config, folder)
    predictor = _take_predictor(config, console)
    number = max((row["walk"] for row in rows), default=-1) + 1
    while todo := next_presses(rows, ways, tries):
        walk_config = replace(config, bus=replace(config.bus, endpoint=free_endpoint()))
        for row in _stop_in_one_walk(walk_config, todo, number, folder, predictor, console):
            rows.append(row)
            append_row(row, folder)
        console.print(f"walk {number}: {len(rows)} presses", highlight=False)
        number += 1
    return rows


def next_presses(rows: Sequence[Mapping[str, Any]], ways: Sequence[str], tries: int) -> list[str]:
    """The ways of the next walk: each in turn that has too few tries yet."""
    done = {way: sum(row["way"] == way for row in rows) for way in ways}
    turns = [way for turn in range(tries) for way in ways if done[way] + turn < tries]
    return turns[:_BLOCK]


def _stop_in_one_walk(
    config: Config,
    ways: Sequence[str],
    number: int,
    folder: Path,
    predictor: _Predictor,
    console: Console,
) -> list[dict[str, Any]]:
    run = folder / f"walk-{number}"
    shutil.rmtree(run, ignore_errors=True)  # of an earlier call, which was interrupted
    run.mkdir(parents=True)
    write_text(run / CONFIG, to_toml(config))
    port = free_port()
    table = process_table(config, run, predictor.file, predictor.sha256)
    chance = np.random.default_rng((config.world.seed, number))
    presses = list[StopPress]()
    with (
        Launch(table, run / "logs") as launch,
        stop_listener(run / CONFIG, run / _HEARD),
        view_beside(run, port, console),
        ExitStack() as stack,
    ):
        url = _await_page(config, launch, run / "logs")
        wish = replace(standing(config), vx=_SPEED)
        page = stack.enter_context(PageDriver(url, wish))
        stack.enter_context(ViewWatcher(port))
        press = {w: stack.enter_context(WAYS[w](page, config.team.name, run)) for w in {*ways}}
        for way in ways:
            _walk_a_while(page, chance)
            presses.append(StopPress(way, press[way]()))
            _await(page, STAND if way in STANDS else ESTOP)
    names = robot_names(config.team.robots)
    found = find_stops(read_heard(run / _HEARD), presses, names, STANDS)
    return [
        {"way": p.way, "ms": None if ms is None else round(ms, 3), "walk": number}
        for p, ms in zip(presses, found, strict=True)
    ]


def _walk_a_while(page: PageDriver, chance: np.random.Generator) -> None:
    """Walk until the press; begin again if words of a busy computer came too late to count."""
    page.walk()
    sleep(chance.uniform(_EARLIEST_S, _LATEST_S))
    while not page.drives():
        page.walk()
        sleep(chance.uniform(_EARLIEST_S, _LATEST_S))


def _await(page: PageDriver, mode: str) -> None:
    """Give the team time to stop; that it has not is told by what is heard."""
    deadline = monotonic() + _STOP_S
    while not page.are_all(mode) and monotonic() < deadline:
        sleep(0.02)
    sleep(0.3)


def _await_page(config: Config, launch: Launch, logs: Path) -> str:
    """The URL of the page from which the team is driven, once there is one."""
    path = socket_path(runtime_dir(), config.team.name, launch.pids[OPERATOR])
    deadline = monotonic() + _START_S
    while monotonic() < deadline and OPERATOR in launch.alive:
        if path.exists():
            try:
                with ControlLink(path) as link:
                    return str(link.ask(WHERE)["url"])
            except (OSError, BusError):
                pass  # it has just begun to listen
        sleep(0.1)
    wanted = f"one within {_START_S:g} s"
    raise ProcessError("the team", "no page to drive from", wanted, f"see what it says in {logs}")


def _take_predictor(config: Config, console: Console) -> _Predictor:
    warm_up(config, console)
    if not find_kind(config.planner.kind).needs_predictor:
        return _Predictor(None, "")
    from quadriga.agents.predictor.gates import load_checked

    file = ensure_predictor(config, console)
    return _Predictor(file, predictor_sha256(load_checked(file, config)[0]))
