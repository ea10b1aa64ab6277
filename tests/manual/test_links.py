"""`make links` finds the links of a page, and names one that leads nowhere."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.manual.links import check_links, find_links
from tests.manual.served import serving


def test_links_to_elsewhere_are_found_once_each(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("[a](https://a.org/b) <https://a.org/b>, https://c.org. http://127.0.0.1:8090")
    found = find_links([page])
    assert found == {"https://a.org/b": ["page.md", "page.md"], "https://c.org": ["page.md"]}


def test_a_link_that_leads_nowhere_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "there.html").touch()
    with serving(tmp_path) as url:
        assert check_links({f"{url}/there.html": ["a.md"], f"{url}/gone.html": ["b.md"]}) == 1
    assert check_links({f"{url}/there.html": ["a.md"]}) == 1  # nobody serves it any more
    gone, there, *_ = capsys.readouterr().out.splitlines()
    assert gone == f"{url}/gone.html (b.md): 404 File not found"
    assert there == f"{url}/there.html (a.md): well"
