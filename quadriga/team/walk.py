"""The main job: a predictor, all processes, a walk, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.shared.codes import FAULT_ENDS
from quadriga.shared.config.reference_trace import trace_of
from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR
from quadriga.shared.messages import Event
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.scheduling import valid_priority
from quadriga.shared.runtime.signals import stop_flag
from quadriga.sim_server.world.faults import Injection
from quadriga.sim_server.world.scenario import build_loads, build_scenario
from quadriga.team.controller_program import check_controller
from quadriga.team.drive_page import DrivePage
from quadriga.team.endpoint import endpoint_claimed
from quadriga.team.fork_server import end_fork_server
from quadriga.team.launch import Launch, ProcessSpec, expect_launch, process_table
from quadriga.team.plants import check_plant
from quadriga.team.progress import WalkProgress
from quadriga.team.registry import team_registered
from quadriga.team.run_folder import make_run_dir
from quadriga.team.spectator import view_beside
from quadriga.view.port import url_of
from quadriga.warm_up import warm_up


class Report(Enum):
    """What is made of a walk's recording once it is over; each has what the one before has."""

    TABLE = "table"
    PAGE = "page"  # with its figures
    PICTURES = "pictures"


OK: Final = 0
FELL: Final = 1
INTERRUPTED: Final = 130


def check_walk(config: Config) -> list[Event]:
    """Refuse what cannot be walked, before anything is written or started.

    Returns:
        Disturbances that will not come: they would begin when the walk is over.

    Raises:
        ConfigError: there is no such plant or controller, its world cannot be built, the trace that
            it follows cannot be read, or the environment asks for a priority that there is not.
    """
    valid_priority(config.runtime.priority)
    check_plant(config)
    check_controller(config)
    events = build_scenario(config, build_loads(config)).events
    faults = Injection(config, robot_names(config.team.robots)).events
    trace_of(config)
    begin = (event for event in (*events, *faults) if event.code != FAULT_ENDS)
    return [event for event in begin if event.tick >= 1000 * config.world.duration]


def walk(
    config: Config,
    out: Path | None,
    *,
    report: Report,
    console: Console,
    armed: bool = False,
    view: int | None = None,
) -> int:
    """Walk the team once; 0 if all walked to the end, 1 if one fell or stopped, 130 if interrupted.

    Args:
        config: the team's configuration.
        out: the run folder; by default `runs/<date>-<time>`.
        report: how much of a report to make of it.
        console: where to show it.
        armed: whether bridges may command their robots.
        view: port of a page that shows the walk; None: none does.

    Raises:
        ProcessError: a process failed or left too early, or the walk did not come to its end.
        QuadrigaError: anything a user can put right before the walk begins.
    """
    expect_launch(config)
    _tell(check_walk(config), config.world.duration, console)
    run_dir = make_run_dir(out, config)
    console.print(f"run folder: {run_dir}", markup=False, highlight=False, soft_wrap=True)
    warm_up(config, console)
    predictor, sha256 = _take_predictor(config, run_dir, console)
    # By another name of this computer, so that the browser draws it in a process of its own: the
    # page to drive from must not be silent while the scene is drawn.
    url = "" if view is None else url_of(view, "localhost")
    rows = process_table(config, run_dir, predictor, sha256, armed=armed, view=url)
    with (
        stop_flag() as stopped,
        endpoint_claimed(config),
        team_registered(config, run_dir),
        view_beside(run_dir, view, console),
    ):
        fallen = watch_walk(config, rows, run_dir, stopped, console)
        if stopped():
            console.print(f"interrupted; what was recorded is in {run_dir}", markup=False)
            return INTERRUPTED
    if not config.recorder.enabled:
        return FELL if fallen else OK
    # Imported late, as the predictor's part is: the processes need not wait for what reads a
    # recording, nor a mere table for what draws figures.
    from quadriga.team.run_summary import has_failed, sum_up

    if report is Report.TABLE:
        summary = sum_up(run_dir, console)
    else:
        from quadriga.team.run_report import report_folder

        summary = report_folder(run_dir, pictures=report is Report.PICTURES, console=console)
    return FELL if fallen or has_failed(summary) else OK


def _tell(late: list[Event], end: float, console: Console) -> None:
    for event in late:
        what = f"{event.kind} {event.robot} {event.detail} at {event.tick / 1000:g} s"
        text = f"will not come: {what}, the walk ends at {end:g} s"
        console.print(text, markup=False, highlight=False, soft_wrap=True)


def _take_predictor(config: Config, run_dir: Path, console: Console) -> tuple[Path | None, str]:
    """The file of the team's predictor and its digest; it and its data are made if there are none.

    Raises:
        PredictorError: there is none that its gates accept.
    """
    kind = find_kind(config.planner.kind)
    if kind.needs_data:
        from quadriga.identification.predictors import ensure_data

        ensure_data(config, console)
    if not kind.needs_predictor:
        return None, ""
    from quadriga.agents.predictor.gates import load_checked
    from quadriga.agents.predictor.store import predictor_sha256
    from quadriga.identification.cache import predictor_path
    from quadriga.replay.recorded_predictor import copy_predictor

    predictor = predictor_path(config)
    if not predictor.is_file():
        from quadriga.identification.predictors import ensure_predictor

        ensure_predictor(config, console)
    sha256 = predictor_sha256(load_checked(predictor, config)[0])
    copy_predictor(predictor, run_dir)
    return predictor, sha256


def watch_walk(
    config: Config,
    rows: tuple[ProcessSpec, ...],
    run_dir: Path,
    stopped: Callable[[], bool],
    console: Console,
) -> list[str]:
    """Run the processes until the walk is over; the robots that fell.

    Raises:
        ProcessError: a process failed or left too early.
    """
    with Launch(rows, run_dir / "logs") as launch, WalkProgress(config, console) as progress:
        end_fork_server()
        page = DrivePage(config, launch.pids.get(OPERATOR, 0), console)

        def update() -> bool:
            page.tell_once()
            progress.update()
            return stopped()

        launch.watch(update)
        progress.update()
        return progress.fallen
