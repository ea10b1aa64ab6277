"""The page of the command line: all of it, as it is today, and nothing that Markdown swallows."""

from __future__ import annotations

import re

import pytest

from quadriga.commands.markdown import to_markdown
from quadriga.commands.parser import build_parser
from quadriga.shared.runtime.places import SOURCE


@pytest.fixture(scope="module")
def page() -> str:
    return to_markdown()


def test_the_committed_page_is_in_step_with_the_code(page: str) -> None:
    committed = SOURCE / "docs" / "reference" / "command_line.md"
    assert committed.read_text(encoding="utf-8") == page, "make docs"


def test_every_command_has_a_section_with_its_own_options(page: str) -> None:
    sections = dict(re.findall(r"^### (\S+)\n(.*?)(?=^###? |\Z)", page, re.MULTILINE | re.DOTALL))
    assert list(sections) == list(build_parser().commands)
    for option in ("--view [PORT]", "--armed", "--out DIR"):
        assert f"`{option}`" in sections["walk"]
    assert "--terrain" not in sections["walk"], "it is an option of the configuration"
    assert "`quadriga certs [options] make|renew|show [NAME …]`" in sections["certs"]
    assert "`--terrain flat" in page.partition("## Options of the configuration")[2]


def test_no_text_of_a_cell_is_taken_for_markup(page: str) -> None:
    for row in re.findall(r"^\| .* \|$", page, re.MULTILINE):
        text = re.sub(r"`[^`]*`", "", row)
        assert not re.search(r"(?<!\\)[<*$]", text), row
        assert len(re.findall(r"(?<!\\)\|", row)) in (3, 4), row
