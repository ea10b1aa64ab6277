"""Links from README and manual to elsewhere: `make links` follows them.

It is no test: what it finds depends on the network and on others. A link that answers is said to be
well; one that does not is named with its pages and the reason.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from tests.manual.blocks import OTHERS, list_pages

_LINK: Final = re.compile(r"https?://[^][)(<>\s\"'`|]+")
_HERE: Final = re.compile(r"https?://(127\.|localhost)")  # what a process of a team serves
_LIMIT: Final = 20.0  # s
_NOT_FOR_PROGRAMS: Final = frozenset((403, 405, 429))  # the server is there, and answers browsers


def find_links(pages: Sequence[Path]) -> dict[str, list[str]]:
    """The links to elsewhere, and the pages that each stands on."""
    found: dict[str, list[str]] = {}
    for page in pages:
        for link in _LINK.findall(page.read_text(encoding="utf-8")):
            if not _HERE.match(link):
                found.setdefault(link.rstrip(".,;:"), []).append(page.name)
    return found


def what_is_wrong(link: str) -> str:
    """Why a link leads nowhere; "" if it leads somewhere."""
    try:
        with urlopen(Request(link, headers={"User-Agent": "quadriga-links"}), timeout=_LIMIT):
            return ""
    except HTTPError as error:
        return "" if error.code in _NOT_FOR_PROGRAMS else f"{error.code} {error.reason}"
    except OSError as error:
        return str(error)


def check_links(found: Mapping[str, Sequence[str]]) -> int:
    """Follow all links and say what came of each; how many lead nowhere."""
    wrong = 0
    for link, pages in sorted(found.items()):
        reason = what_is_wrong(link)
        wrong += bool(reason)
        print(f"{link} ({', '.join(dict.fromkeys(pages))}): {reason or 'well'}", flush=True)
    return wrong


if __name__ == "__main__":
    sys.exit(bool(check_links(find_links([*list_pages(), *OTHERS]))))
