"""Whether trials are of the same code is told where it can be, and not guessed where it cannot."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadriga.experiments.trial.origin import code_and_libraries, foreign_origin, is_same_code
from quadriga.shared.config.load import load

HERE = "python 3.11.7, numpy 2.4, code 1a, sources 2b, arithmetic 3c"


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({}, True),
        ({"sources 2b": "sources 99"}, True),  # names and comments alone
        ({"sources 2b": "sources 99", "code 1a": "code 99"}, False),
        ({"code 1a": "code 99", "arithmetic 3c": "arithmetic 99"}, True),  # other last digits
        ({"code 1a": "code 99", "sources 2b": "sources 99", "arithmetic 3c": "arithmetic 9"}, None),
        ({"sources 2b, ": ""}, True),  # of a version that did not note them
        ({"sources 2b, ": "", "code 1a": "code 99"}, False),
        ({"sources 2b, ": "", "arithmetic 3c": "arithmetic 99"}, None),
        ({"numpy 2.4": "numpy 2.5"}, False),
        ({"numpy 2.4, ": ""}, False),
    ],
)
def test_same_code_is_told_by_what_it_does_or_by_its_sources(
    change: dict[str, str], same: bool | None
) -> None:
    there = HERE
    for old, new in change.items():
        assert old in there
        there = there.replace(old, new)
    assert is_same_code(HERE, there) is same
    assert is_same_code(there, HERE) is same


def test_what_is_no_list_of_versions_is_of_other_code() -> None:
    assert is_same_code("code 1", "code 2") is False
    assert is_same_code("edited", HERE) is False


def test_versions_name_code_sources_and_arithmetic() -> None:
    names = [part.rpartition(" ")[0] for part in code_and_libraries().split(", ")]
    assert names[0] == "python"
    assert names[-3:] == ["code", "sources", "arithmetic"]
    assert len(set(names)) == len(names)


def test_a_controller_of_ones_own_is_named_with_its_files(tmp_path: Path) -> None:
    script = tmp_path / "walk.py"
    script.touch()
    assert foreign_origin(load(None)) == ""
    origin = foreign_origin(load(None, {"team.agent_command": f"python {script}"}))
    assert origin.startswith(f"python {script} ")
