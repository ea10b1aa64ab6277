"""The page: sections in the order in which one asks, each left out if there is nothing to show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from quadriga.pictures.frames import CLIP
from quadriga.recordings.summary_table import list_figures
from quadriga.report import about, captions, foot_figures, process_figures, trunk_figures
from quadriga.report.conditions import COLUMNS
from quadriga.report.document import (
    Cell,
    Clip,
    Document,
    Drawing,
    Fold,
    MovingScene,
    PageTable,
    Paragraph,
    Part,
    Section,
    Subtitle,
    Text,
    time_link,
)
from quadriga.report.run import ReportedRun
from quadriga.report.timeline import TimelineEntry
from quadriga.report.top_view import draw_top_view
from quadriga.report.trouble_figure import draw_trouble
from quadriga.report.troubles import Trouble, find_troubles
from quadriga.shared.errors import RecordingError, name_file_errors
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.runtime.atomic import write_text

PAGE: Final = "report.html"
_TROUBLES: Final = 6  # shown in full
_ENTRIES: Final = 200  # of the timeline, listed
_OPENED: Final = 40  # entries that are listed unfolded
_LASTING_MS: Final = 10
_TIMES: Final = (
    "process", "solves", "median [ms]", "99 % [ms]", "greatest [ms]",
    "ticks", "median [µs]", "99 % [µs]", "greatest [µs]",
)  # fmt: skip
_TRAFFIC: Final = ("key", "messages", "rate [Hz]", "from … to [s]", "missing", "invalid")


def write_page(run: ReportedRun, path: Path, scene: str = "") -> Path:
    """Write the page of a run, with the clip that lies beside the recording, if any.

    Args:
        run: what it is about.
        path: of the page.
        scene: JSON of `quadriga.moving_scene`; none if empty.

    Raises:
        RecordingError: the file cannot be written.
    """
    clip = _read_clip(run.path)
    with name_file_errors(RecordingError, path, "a file that can be written"):
        write_text(path, build_page(run, clip, scene))
    return path


def _read_clip(recording: Path) -> bytes:
    """The clip of a recording, nothing if there is none or if it is older than the recording."""
    clip = recording.with_name(CLIP)
    try:
        if clip.stat().st_mtime_ns >= recording.stat().st_mtime_ns:
            return clip.read_bytes()
    except OSError:  # not drawn, or not for our eyes: the page does without
        pass
    return b""


def build_page(run: ReportedRun, clip: bytes = b"", scene: str = "") -> str:
    """The whole page as HTML; it loads nothing from anywhere.

    Args:
        run: what it is about.
        clip: moving pictures of the run, WebP; none if empty.
        scene: JSON of `quadriga.moving_scene`; none if empty.
    """
    lead, good = about.judge(run)
    return Document(
        title=about.build_title(run),
        lead=lead,
        sections=list(_build_sections(run, clip, scene)),
        verdict="good" if good else "bad",
        notes=about.describe_missing(run),
        clock=True,
        moving=bool(scene),
    ).to_html()


def _build_sections(run: ReportedRun, clip: bytes, scene: str) -> Iterator[Section]:
    yield Section("run", "The run", _build_run(run))
    summary = PageTable((), list_figures(run.summary), named=True)
    yield Section("summary", "Summary", [summary])
    if clip:
        shown = Clip(clip, "the team walking", captions.CLIP)
        yield Section("clip", "The walk to look at", [shown])
    if scene:
        yield Section("scene", "From all sides", [MovingScene(scene, captions.SCENE)])
    troubles = find_troubles(run)
    if troubles:
        yield Section("look", "What to look at", list(_build_troubles(run, troubles)))
    yield Section("timeline", "Timeline", _build_timeline(run))
    yield from _build_trunks(run)
    yield from _build_feet(run)
    yield from _build_processes(run)
    traffic = PageTable(_TRAFFIC, about.list_traffic(run), numbers=True)
    yield Section("traffic", "The recording", [traffic])


def _build_run(run: ReportedRun) -> list[Part]:
    facts = PageTable((), list(about.list_facts(run)), named=True)
    changed = about.list_changed_keys(run.traces.config)
    if not changed:
        return [facts, Paragraph(["Every key of the configuration has its default value."])]
    title = f"Keys of the configuration that differ from their defaults: {len(changed)}"
    keys = PageTable(("key", "value", "default", "meaning"), changed)
    return [facts, Fold(title, [keys], opened=True)]


def _build_troubles(run: ReportedRun, troubles: Sequence[Trouble]) -> Iterator[Part]:
    yield Paragraph(
        [
            "For each fall, fault or stop: the second before it, what was out of the ordinary then "
            "and in which order it came. Unusual figures are marked."
        ]
    )
    for trouble in troubles[:_TROUBLES]:
        yield from _build_trouble(run, trouble)
    rest = troubles[_TROUBLES:]
    if rest:
        links: list[Text] = [f"{len(rest)} more, in the timeline: "]
        for trouble in rest:
            links += [time_link(trouble.tick), " "]
        yield Paragraph(links)


def _build_trouble(run: ReportedRun, trouble: Trouble) -> Iterator[Part]:
    what = "; ".join(f"{e.robot or 'world'} {e.kind}: {e.text}" for e in trouble.entries)
    yield Subtitle([time_link(trouble.tick), f" · {what}"])
    rows: list[list[Text]] = [
        [condition.robot, *(Cell(text, marked=marked) for text, marked in condition.cells)]
        for condition in trouble.conditions
    ]
    yield PageTable(("robot", *COLUMNS), rows)
    figure = draw_trouble(run, trouble)
    yield Drawing(figure, f"the second before {trouble.tick / 1000:.3f} s")
    signs: list[list[Text]] = [
        [time_link(sign.tick), sign.robot or "world", sign.text] for sign in trouble.signs
    ]
    first: Part = PageTable(("time", "robot", "what"), signs)
    if not signs:
        first = Paragraph(["Nothing out of the ordinary was recorded in this second."])
    yield Fold("What came first", [first], opened=True)


def _build_timeline(run: ReportedRun) -> list[Part]:
    rows = [_build_row(entry) for entry in run.timeline[:_ENTRIES]]
    listed: list[Part] = [PageTable(("time", "robot", "kind", "what"), rows)]
    more = len(run.timeline) - len(rows)
    if more > 0:
        listed.append(Paragraph([f"{more} more are left out."]))
    return [
        Drawing(process_figures.draw_timeline(run), "timeline"),
        Paragraph(["A time is a link: it shows that time in every figure."], soft=True),
        Fold(f"{len(rows)} entries", listed, opened=len(rows) <= _OPENED),
    ]


def _build_row(entry: TimelineEntry) -> list[Text]:
    when = time_link(entry.tick)
    if entry.stop - entry.tick >= _LASTING_MS:
        when = Cell(f"{when.text} … {entry.stop / 1000:.2f} s", when.href)
    return [when, entry.robot, Cell(entry.kind, marked=entry.trouble), entry.text]


def _build_trunks(run: ReportedRun) -> Iterator[Section]:
    robots = run.traces.robots
    if any(len(run.outputs_of(i)[0]) for i in range(len(robots))):
        yield Section("trajectories", "Trajectories", list(_build_trajectories(run)))
        source = "true" if run.has_truth else "estimated"
        text = f"Each robot's {source} output, averaged over one gait period."
        drawing = Drawing(trunk_figures.draw_reference(run), "reference against measured")
        yield Section("reference", "Reference against measured", [Paragraph([text]), drawing])
    if not run.has_truth:
        return
    drawing = Drawing(draw_top_view(run.traces), "paths from above", captions.PATHS)
    yield Section("paths", "Paths from above", [drawing])
    if any(len(measured.tick) for measured in run.traces.measurements.values()):
        text = "What the agent estimated, less the truth at the same tick."
        if run.traces.config.world.uneven:
            text += (
                " The height is not compared: the agent's is that over the ground which the feet "
                "feel, the truth's that over the terrain under the hips."
            )
        drawing = Drawing(trunk_figures.draw_estimator_errors(run), "estimator errors")
        yield Section("estimator", "Estimator errors", [Paragraph([text]), drawing])
    if run.traces.truth.yoke_error.shape[1:] not in ((), (0,)):
        yield Section("yokes", "Yokes", [Drawing(trunk_figures.draw_yokes(run), "yokes")])


def _build_trajectories(run: ReportedRun) -> Iterator[Part]:
    for i, robot in enumerate(run.traces.robots):
        figure, caption = trunk_figures.draw_trajectory(run, i), "" if i else captions.outputs(run)
        whole = Drawing(figure, f"trajectories of {robot}", caption)
        yield Fold(robot, [whole], opened=i < 3)
        near = trunk_figures.draw_trajectory(run, i, foot_figures.four_strides(run))
        name = f"{robot}, four strides enlarged"
        yield Fold(name, [Drawing(near, name)], opened=i == 0)
    if trunk_figures.mark_falls(run):
        text = "The axes are chosen by what came before the first fall."
        yield Paragraph([text], soft=True)


def _build_feet(run: ReportedRun) -> Iterator[Section]:
    sensed = any(len(samples.tick) for samples in run.samples.values())
    if run.has_truth or sensed:
        begin, end = foot_figures.four_strides(run)
        parts: list[Part] = [
            Drawing(foot_figures.draw_forces(run), "vertical forces", captions.forces(run)),
            Subtitle([f"All feet in four strides, {begin:.2f} … {end:.2f} s"]),
            Drawing(foot_figures.draw_forces_enlarged(run), "vertical forces, four strides"),
        ]
        yield Section("forces", "Vertical forces", parts)
    if sensed:
        figure, begin, end = foot_figures.draw_gait(run)
        parts = [Drawing(figure, "gait")]
        if (begin, end) != (run.begin / 1000, run.end / 1000):
            parts.insert(0, Paragraph([f"From {begin:.2f} to {end:.2f} s."]))
        yield Section("gait", "Gait", parts)


def _build_processes(run: ReportedRun) -> Iterator[Section]:
    if not any(run.traces.statuses.values()) and not any(run.traces.plans.values()):
        return
    times = PageTable(_TIMES, process_figures.list_times(run), numbers=True)
    drawing = Drawing(process_figures.draw_times(run), "solve and tick times")
    yield Section(
        "times", "Solve and tick times", [drawing, times, Paragraph([captions.TIMES], soft=True)]
    )
    central = find_kind(run.traces.config.planner.kind).central
    what = "the plan in force was" if central else "each peer's plan was when it was planned with"
    drawing = Drawing(process_figures.draw_ages(run), "ages of inputs")
    text = f"How old, by world time, {what}."
    yield Section("ages", "Ages of inputs", [Paragraph([text]), drawing])
