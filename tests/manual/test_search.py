"""The search of the built manual leads from what a reader would type to the page about it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final
from urllib.parse import quote

import pytest

from tests.browser import CHROMIUM, WHY_NOT, Browser, browser
from tests.manual.blocks import DOCS
from tests.manual.served import serving

BUILT: Final = DOCS / "_build"
FOUND: Final = "[...document.querySelectorAll('#search-results li a')].map(a => a.pathname)"
SUMMARY: Final = "document.querySelector('#search-results .search-summary')?.innerText"
FIRST: Final = 10  # pages of an answer; whoever does not find it there asks for something else

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason=WHY_NOT),
    pytest.mark.skipif(not (BUILT / "search.html").is_file(), reason="no manual: make manual"),
]


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    """The manual, served: a page of a file may not read the index."""
    with serving(BUILT) as address:
        yield address


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("browser")) as opened:
        yield opened


def find(chromium: Browser, url: str, words: str) -> list[str]:
    """The pages that a search finds, the best first."""
    with chromium.open(f"{url}/search.html?q={quote(words)}") as page:
        page.await_true(f"/finished|did not match/.test({SUMMARY})")
        found = page.evaluate(FOUND)
        assert [text for text in page.complaints if "favicon" not in text] == []
    return list(dict.fromkeys(name.strip("/").removesuffix(".html") for name in found))


@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("estop", "how/safety"),
        ("late commands", "troubleshooting"),
        ("ridge", "tutorials/fit_a_predictor"),
        ("certificate", "security"),
    ],
)
def test_a_search_finds_the_page_about_it(
    chromium: Browser, url: str, words: str, page: str
) -> None:
    assert page in find(chromium, url, words)[:FIRST]


def test_a_search_for_what_is_on_no_page_says_so(chromium: Browser, url: str) -> None:
    assert find(chromium, url, "xyzzyq") == []
