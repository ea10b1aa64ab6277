"""README and manual as files: nothing leads nowhere, and every page can be found."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import pytest

from quadriga.shared.runtime.places import SOURCE
from tests.manual.blocks import DOCS, OTHERS, list_pages

PAGES: Final = [*list_pages(), *OTHERS]
_CODE: Final = re.compile(r"^```.*?^```|`[^`\n]*`", re.MULTILINE | re.DOTALL)
_LINK: Final = re.compile(r"\]\(([^)\s]+)\)")
_ANCHOR: Final = re.compile(r'<a id="([^"]+)"></a>')


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def anchors_of(page: Path) -> set[str]:
    """What `page#…` may name: headings as GitHub calls them, and anchors."""
    text = text_of(page)
    plain = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    found, seen = set(_ANCHOR.findall(text)), dict[str, int]()
    for heading in re.findall(r"^#+ (.*)$", plain, re.MULTILINE):
        shown = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()
        slug = re.sub(r"[^\w\- ]", "", shown).strip().replace(" ", "-")
        count = seen.get(slug, 0)
        seen[slug] = count + 1
        found.add(f"{slug}-{count}" if count else slug)
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(SOURCE).as_posix())
def test_every_link_leads_somewhere(page: Path) -> None:
    for link in _LINK.findall(_CODE.sub("", text_of(page))):
        if "://" in link:
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), link
        if anchor:
            assert anchor in anchors_of(target), link


def test_every_page_is_in_the_table_of_contents() -> None:
    listed = re.findall(r"^```\{toctree\}\n(.*?)^```", text_of(DOCS / "index.md"), re.M | re.S)
    names = {line for part in listed for line in part.splitlines() if line and line[0] != ":"}
    pages = {path.relative_to(DOCS).with_suffix("").as_posix() for path in list_pages()[1:]}
    assert names == pages - {"index"}


def test_what_code_and_messages_point_to_is_there() -> None:
    named = set[str]()
    for wall in ("agents", "bridges", "plant", "shared", "sim_server", "quadriga", "deploy"):
        for path in (SOURCE / wall).rglob("*"):
            if path.suffix in (".py", ".toml", ".yml") and path.is_file():
                named |= set(re.findall(r"docs/[\w/.-]+\.md", text_of(path)))
    named |= set(re.findall(r"docs/[\w/.-]+\.md", text_of(SOURCE / "docker-compose.yml")))
    assert len(named) > 8
    assert [name for name in sorted(named) if not (SOURCE / name).is_file()] == []
