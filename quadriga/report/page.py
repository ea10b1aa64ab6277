"""The page: sections in the order in which one asks, each left out if there is nothing to show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import Final

from quadriga.report import about, feet, machine, tracks
from quadriga.report.account import COLUMNS
from quadriga.report.html import cells, details, document, figure, key, keys, table, time_link
from quadriga.report.look import SCRIPT
from quadriga.report.look_at import Trouble, episodes
from quadriga.report.moments import Moment
from quadriga.report.run import Run
from quadriga.shared.bus.members import PLANNER
from quadriga.shared.config.sections import CENTRAL
from quadriga.shared.errors import RecordingError
from quadriga.table import rows as summary_rows

PAGE: Final = "report.html"
_EPISODES: Final = 6  # shown in full
_MOMENTS: Final = 200


def write_page(run: Run, path: Path) -> Path:
    """Write the page of a run.

    Raises:
        RecordingError: the file cannot be written.
    """
    try:
        path.write_text(build_page(run), encoding="utf-8")
    except OSError as error:
        raise RecordingError(
            str(path), error.strerror or str(error), "a file that can be written"
        ) from None
    return path


def build_page(run: Run) -> str:
    """The whole page as HTML; it loads nothing from anywhere."""
    text, good = about.verdict(run)
    head = f'<p class="verdict {"good" if good else "bad"}">{escape(text)}</p>{_absent(run)}'
    return document(about.title(run), head, list(_sections(run)), SCRIPT)


Section = tuple[str, str, str]  # anchor, title, HTML


def _sections(run: Run) -> Iterator[Section]:
    yield "run", "The run", _run(run)
    yield "summary", "Summary", table((), summary_rows(run.summary), named=True)
    troubles = episodes(run)
    if troubles:
        yield "look", "What to look at", _look(run, troubles)
    yield "timeline", "Timeline", _timeline(run)
    yield from _trunks(run)
    yield from _feet(run)
    yield from _machine(run)
    yield (
        "traffic",
        "The recording",
        table(
            ("key", "messages", "rate [Hz]", "from … to [s]", "missing", "invalid"),
            about.traffic(run),
            numbers=True,
        ),
    )


def _absent(run: Run) -> str:
    said = "".join(f"<p>{escape(text)}</p>" for text in about.absent(run))
    return f'<div class="note">{said}</div>' if said else ""


def _run(run: Run) -> str:
    config = run.traces.config
    changed = about.not_usual(config)
    facts = table((), list(about.facts(run)), named=True)
    if not changed:
        return facts + "<p>Every key of the configuration has its default value.</p>"
    return facts + details(
        f"Keys of the configuration that differ from their defaults: {len(changed)}",
        table(("key", "value", "default", "meaning"), changed),
        opened=True,
    )


def _look(run: Run, troubles: Sequence[Trouble]) -> str:
    parts = [
        "<p>For each fall, fault or stop: the second before it, what was out of the ordinary then "
        "and in which order it came. Unusual figures are marked.</p>"
    ]
    for episode in troubles[:_EPISODES]:
        parts.append(_episode(run, episode))
    if len(troubles) > _EPISODES:
        rest = ", ".join(time_link(episode.tick) for episode in troubles[_EPISODES:])
        parts.append(f"<p>{len(troubles) - _EPISODES} more, in the timeline: {rest}.</p>")
    return "".join(parts)


def _episode(run: Run, episode: Trouble) -> str:
    what = "; ".join(f"{m.robot or 'world'} {m.kind}: {m.text}" for m in episode.troubles)
    signs = [
        (time_link(sign.tick), escape(sign.robot or "world"), escape(sign.text))
        for sign in episode.signs
    ]
    told = (
        table(("time", "robot", "what"), signs, raw=True)
        if signs
        else ("<p>Nothing out of the ordinary was recorded in this second.</p>")
    )
    accounts = [[(a.robot, False), *a.cells] for a in episode.accounts]
    robots = "".join(key(tracks.style(i), r) for i, r in enumerate(run.traces.robots))
    return (
        f"<h3>{time_link(episode.tick)} · {escape(what)}</h3>"
        f"{cells(('robot', *COLUMNS), accounts)}"
        f"{figure(machine.closeup(run, episode), robots + _gait_keys(run))}"
        f"{details('What came first', told, opened=True)}"
    )


def _timeline(run: Run) -> str:
    legend = keys(
        ("mode-walk", "walk"),
        ("mode-stand", "stand"),
        ("mode-stopping", "stopping; plan faded"),
        ("mode-damping", "damping, e-stop; messages missing"),
        ("nominal", "other plan status"),
        ("count", "counted by the agent"),
    )
    main = machine.timeline(run).replace("<svg ", '<svg data-main="" ', 1)
    rows = [_moment(moment) for moment in run.moments[:_MOMENTS]]
    more = len(run.moments) - len(rows)
    text = table(("time", "robot", "kind", "what"), rows, raw=True)
    if more > 0:
        text += f"<p>{more} more are left out.</p>"
    hint = "<p class='soft'>A time is a link: it shows that time in every figure.</p>"
    opened = len(rows) <= 40
    return figure(main, legend) + hint + details(f"{len(rows)} entries", text, opened=opened)


def _moment(moment: Moment) -> tuple[str, ...]:
    when = time_link(moment.tick)
    if moment.stop - moment.tick >= 10:
        when += f" … {moment.stop / 1000:.2f} s"
    kind = f'<b class="bad">{escape(moment.kind)}</b>' if moment.trouble else escape(moment.kind)
    return when, escape(moment.robot), kind, escape(moment.text)


def _trunks(run: Run) -> Iterator[Section]:
    robots = run.traces.robots
    named = "".join(key(tracks.style(i), robot) for i, robot in enumerate(robots))
    asked = key("asked", "asked for")
    if any(len(run.measured(i)[0]) for i in range(len(robots))):
        legend = (
            (key("true", "measured (truth)") if run.has_truth else "")
            + key("own", "estimated by the agent")
            + key("planned", "planned")
            + asked
        )
        parts = []
        for i, robot in enumerate(robots):
            whole = figure(tracks.trajectories(run, i), legend)
            parts.append(details(robot, whole, opened=i < 3))
            near = figure(tracks.trajectories(run, i, feet.strides(run)), legend)
            parts.append(details(f"{robot}, four strides enlarged", near, opened=i == 0))
        fell = "<p class='soft'>The axes are chosen by what came before the first fall.</p>"
        parts.append(fell if tracks.falls(run) else "")
        yield "trajectories", "Trajectories", "".join(parts)
        source = "true" if run.has_truth else "estimated"
        text = f"<p>Each robot's {source} output, averaged over one gait period.</p>"
        yield (
            "reference",
            "Reference against measured",
            text + figure(tracks.reference_against_measured(run), named + asked),
        )
    if run.has_truth:
        yield "paths", "Paths from above", figure(tracks.top_view(run), named)
        if any(len(measured.tick) for measured in run.traces.measurements.values()):
            text = "<p>What the agent estimated, less the truth at the same tick"
            if run.traces.config.world.uneven:
                text += ". The height is not compared: it is that over the ground which the feet "
                text += "feel, the truth's that over the terrain under the hips"
            text += ".</p>"
            yield (
                "estimator",
                "Estimator errors",
                text + figure(tracks.estimator_errors(run), named),
            )
        if run.traces.truth.yoke_error.shape[1:] not in ((), (0,)):
            legend = "".join(
                key(tracks.style(k), name) for k, name in enumerate(tracks.yoke_names(run))
            )
            yield "yokes", "Yokes", figure(tracks.yokes(run), legend)


def _feet(run: Run) -> Iterator[Section]:
    if run.has_truth or any(len(s.tick) for s in run.samples.values()):
        source = "ground reaction (truth)" if run.has_truth else "measured by the foot sensor"
        legend = key("true", source) + key("planned", "planned, as applied")
        svg, begin, end = feet.enlarged(run)
        text = f"<h3>All feet in four strides, {begin:.2f} … {end:.2f} s</h3>"
        yield "forces", "Vertical forces", figure(feet.whole(run), legend) + text + figure(svg)
    if any(len(samples.tick) for samples in run.samples.values()):
        svg, begin, end = feet.gait(run)
        text = (
            ""
            if (begin, end) == (run.begin / 1000, run.end / 1000)
            else (f"<p>From {begin:.2f} to {end:.2f} s.</p>")
        )
        yield "gait", "Gait", text + figure(svg, _gait_keys(run))


def _gait_keys(run: Run) -> str:
    contact = "true contact" if run.has_truth else "contact by the foot sensor"
    return keys(("stance", "scheduled stance"), ("contact", contact))


def _machine(run: Run) -> Iterator[Section]:
    if not any(run.traces.statuses.values()) and not any(run.traces.plans.values()):
        return
    central = run.traces.config.planner.kind in CENTRAL
    named = "".join(key(tracks.style(i), robot) for i, robot in enumerate(run.traces.robots))
    head = (
        "process",
        "solves",
        "median [ms]",
        "99 % [ms]",
        "greatest [ms]",
        "ticks",
        "median [µs]",
        "99 % [µs]",
        "greatest [µs]",
    )
    drawn = figure(machine.times(run), named + (key("asked", PLANNER) if central else ""))
    told = table(head, machine.times_table(run), numbers=True)
    yield "times", "Solve and tick times", drawn + told
    what = "the plan in force was" if central else "each peer's plan was when it was planned with"
    legend = key("planned", "central plan") if central else named
    drawn = figure(machine.ages(run), legend + key("asked", "reference"))
    yield "ages", "Ages of inputs", f"<p>How old, by world time, {what}.</p>{drawn}"
