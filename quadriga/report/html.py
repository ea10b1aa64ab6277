"""The few kinds of HTML that the page is made of. What is not called raw is escaped here."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from quadriga.report.look import style_sheet


def document(title: str, head: str, sections: Sequence[tuple[str, str, str]], script: str) -> str:
    """A whole page that loads nothing from anywhere.

    Args:
        title: of the page.
        head: HTML between the title and the links to the sections.
        sections: anchor, title and HTML of each.
        script: at the page's end; may be empty.
    """
    links = "".join(f'<a href="#{name}">{escape(text)}</a>' for name, text, _ in sections)
    body = "".join(section(*part) for part in sections)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{style_sheet()}</style></head><body>"
        f"<h1>{escape(title)}</h1>{head}<nav>{links}</nav>{body}"
        + (f'<div id="clock"></div><script>{script}</script>' if script else "")
        + "</body></html>\n"
    )


def section(anchor: str, title: str, content: str) -> str:
    """A section that links can lead to."""
    return f'<section id="{anchor}"><h2>{escape(title)}</h2>{content}</section>'


def details(title: str, content: str, *, opened: bool) -> str:
    """Something that can be folded away."""
    state = " open" if opened else ""
    return f"<details{state}><summary>{escape(title)}</summary>{content}</details>"


def figure(svg: str, legend: str = "") -> str:
    """A figure below its legend."""
    return f"<figure><figcaption>{legend}</figcaption>{svg}</figure>"


def key(style: str, name: str) -> str:
    """An entry of a legend: a line."""
    line = f'<svg viewBox="0 0 26 12"><path class="curve {style}" d="M0 6h26"/></svg>'
    return f'<span class="key">{line}{escape(name)}</span>'


def keys(*bars: tuple[str, str]) -> str:
    """Entries of a legend: bars by class and name."""
    return "".join(
        f'<span class="key"><svg viewBox="0 0 26 12"><rect class="{style}" width="26" '
        f'height="12"/></svg>{escape(name)}</span>'
        for style, name in bars
    )


def time_link(tick: int) -> str:
    """A world time that leads to itself in every figure."""
    return f'<a href="#t={tick / 1000:.3f}">{tick / 1000:.2f} s</a>'


def table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    named: bool = False,
    numbers: bool = False,
    raw: bool = False,
) -> str:
    """A table of text.

    Args:
        head: headings; empty for none.
        rows: cells.
        named: the first cell of each row is its name.
        numbers: all cells but the first are figures.
        raw: cells are HTML.
    """
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    lines = [f"<tr>{top}</tr>"] if head else []
    for row in rows:
        texts = [cell if raw else escape(cell) for cell in row]
        first = '<td class="name">' if named else "<td>"
        lines.append(f"<tr>{first}{'</td><td class=pre>'.join(texts)}</td></tr>")
    style = ' class="number"' if numbers else ""
    return f'<div class="wide"><table{style}>{"".join(lines)}</table></div>'


def cells(head: Sequence[str], rows: Sequence[Sequence[tuple[str, bool]]]) -> str:
    """A table whose cells may be marked; a row shorter than the head fills it with its last."""
    lines = ["".join(f"<th>{escape(name)}</th>" for name in head)]
    for row in rows:
        line = ""
        for k, (text, marked) in enumerate(row):
            span = f' colspan="{len(head) - k}"' if k == len(row) - 1 < len(head) - 1 else ""
            line += f"<td{span}{' class=bad' if marked else ''}>{escape(text)}</td>"
        lines.append(line)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<div class="wide"><table>{body}</table></div>'
