"""What a look at a team and at this computer has found: as lines, and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from quadriga.shared.bus.diagnostics import BAD, Diagnosis, MemberAnswer
from quadriga.tables import align_columns

FORMAT: Final = 1  # of the JSON; a field that is added does not change it


@dataclass(frozen=True, slots=True)
class MemberReport:
    """One process of the team: what it has said, and what is to be said of it."""

    name: str
    answers: Sequence[MemberAnswer]
    diagnoses: tuple[Diagnosis, ...]


@dataclass(frozen=True, slots=True)
class DoctorReport:
    """All that was found.

    Attributes:
        team: its name.
        endpoint: where it is.
        version: of quadriga, here.
        link: how this computer reaches that endpoint.
        here: of this computer, and of what the command was given.
        members: of each process; None: nobody was asked.
    """

    team: str
    endpoint: str
    version: str
    link: Diagnosis
    here: tuple[Diagnosis, ...]
    members: tuple[MemberReport, ...] | None = None

    @property
    def is_well(self) -> bool:
        """Whether nothing is wrong; what is unknown is not."""
        said = [d for member in self.members or () for d in member.diagnoses]
        return not any(d.verdict == BAD for d in (self.link, *self.here, *said))


def format_report(report: DoctorReport) -> list[str]:
    """A line for each finding: whose it is, how bad, what it is, and what to do."""
    lines = [f"team {report.team!r} at {report.endpoint}"]
    rows = [*_rows("link", (report.link,))]
    for member in report.members or ():
        rows += _rows(member.name, member.diagnoses)
    here = [row for item in report.here for row in _rows(item.code, (item,))]
    lines += align_columns(rows)
    return [*lines, "this computer", *align_columns(here)] if here else lines


def to_json(report: DoctorReport) -> str:
    """One JSON object; docs/doctor.md lists its fields."""
    body: dict[str, Any] = {
        "format": FORMAT,
        "well": report.is_well,
        "version": report.version,
        "team": report.team,
        "endpoint": report.endpoint,
        "link": asdict(report.link),
        "here": [asdict(item) for item in report.here],
    }
    if report.members is not None:
        body["members"] = [_member(member) for member in report.members]
    return json.dumps(body, indent=2, ensure_ascii=False)


def _rows(name: str, diagnoses: Sequence[Diagnosis]) -> Iterator[tuple[str, str, str]]:
    for item in diagnoses:
        text = f"{item.text} → {item.remedy}" if item.remedy else item.text
        yield name, item.verdict, text
        name = ""


def _member(member: MemberReport) -> dict[str, Any]:
    return {
        "name": member.name,
        "processes": [_process(answer) for answer in member.answers],
        "diagnoses": [asdict(item) for item in member.diagnoses],
    }


def _process(answer: MemberAnswer) -> dict[str, Any]:
    about = answer.about
    if about is None:
        return {}
    offset, error = answer.clock_offset
    return {
        "host": about.host,
        "pid": about.pid,
        "version": about.version,
        "code": about.code,
        "predictor": about.predictor,
        "stage": about.stage,
        "sees": list(about.sees),
        "clock_offset_s": offset,
        "clock_offset_error_s": error,
    }
