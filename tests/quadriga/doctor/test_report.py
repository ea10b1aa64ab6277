"""What was found, as lines and as the JSON that docs/doctor.md describes."""

from __future__ import annotations

import json

from quadriga.doctor.examine import LINK
from quadriga.doctor.machine import check_machine
from quadriga.doctor.report import DoctorReport, MemberReport, format_report, to_json
from quadriga.shared.bus.diagnostics import BAD, GOOD, NOTE, UNKNOWN, Diagnosis
from quadriga.shared.runtime.places import SOURCE
from tests.quadriga.doctor.test_machine import FIT, WALK
from tests.shared.bus.abouts import about, answer

DOC = (SOURCE / "docs" / "doctor.md").read_text(encoding="utf-8")
LINKED = Diagnosis(LINK, GOOD, "linked by tcp/127.0.0.1:1")
HERE = Diagnosis("cores", NOTE, "2 cores for 4 processes", "spread the team")
LEAD = MemberReport("sim", (answer(about("sim")),), (Diagnosis("ready", GOOD, "ready"),))
R1 = MemberReport(
    "r1",
    (answer(None),),
    (Diagnosis("here", NOTE, "here"), Diagnosis("clock-off", BAD, "3 s ahead", "set it")),
)


def report(*members: MemberReport, here: Diagnosis = HERE) -> DoctorReport:
    return DoctorReport("team", "tcp/127.0.0.1:1", "0.1.0", LINKED, (here,), members)


def test_a_line_for_each_finding_with_what_to_do() -> None:
    assert format_report(report(LEAD, R1)) == [
        "team 'team' at tcp/127.0.0.1:1",
        "  link  good  linked by tcp/127.0.0.1:1",
        "  sim   good  ready",
        "  r1    note  here",
        "        bad   3 s ahead → set it",
        "this computer",
        "  cores  note  2 cores for 4 processes → spread the team",
    ]


def test_notes_and_what_is_unknown_are_no_illness() -> None:
    assert report(LEAD).is_well
    assert report(LEAD, here=Diagnosis("cores", UNKNOWN, "?")).is_well
    assert not report(LEAD, here=Diagnosis("cores", BAD, "1 core", "more")).is_well
    assert not report(LEAD, R1).is_well


def test_every_field_of_the_json_is_documented() -> None:
    body = json.loads(to_json(report(LEAD, R1)))
    assert (body["well"], body["format"]) == (False, 1)
    assert [m["name"] for m in body["members"]] == ["sim", "r1"]
    assert body["members"][1]["processes"] == [{}]
    (process,) = body["members"][0]["processes"]
    fields = {*body, *process, *(f"members[].{key}" for key in body["members"][0]), *body["link"]}
    assert {field for field in fields if f"`{field}`" not in DOC} == set()
    alone = DoctorReport("team", "tcp/127.0.0.1:1", "", LINKED, (HERE,))
    assert "members" not in json.loads(to_json(alone))


def test_every_code_of_this_computer_is_documented() -> None:
    codes = [item.code for item in check_machine(FIT, WALK)]
    assert len({*codes}) == 10
    assert {code for code in (*codes, LINK) if f"`{code}`" not in DOC} == set()
