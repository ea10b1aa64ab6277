"""The published times of stopping, as a table of docs/driving.md: `make docs`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.places import SOURCE
from quadriga.stop_times.figures import build_stop_table, sum_up
from quadriga.stop_times.ways import WAYS
from quadriga.team.trial_rows import read_rows

PAGE: Final = SOURCE / "docs" / "driving.md"
PUBLISHED: Final = SOURCE / "docs" / "results" / "stops"
_BEGIN: Final = "<!-- stops: made by python -m quadriga.stop_times.page -->\n"
_END: Final = "<!-- end of stops -->\n"


def stop_table(folder: Path = PUBLISHED) -> str:
    """A line for each way to stop a team, of the tries that are in a folder."""
    rows = read_rows(folder)
    tries = {way: [row["ms"] for row in rows if row["way"] == way] for way in WAYS}
    figures = sum_up({way: times for way, times in tries.items() if times})
    return build_stop_table(figures).to_markdown(3)


def renewed(page: str) -> str:
    """The page with the table of today's rows."""
    before, begin, rest = page.partition(_BEGIN)
    _, end, after = rest.partition(_END)
    return before + begin + stop_table() + end + after


if __name__ == "__main__":
    write_text(PAGE, renewed(PAGE.read_text(encoding="utf-8")))
