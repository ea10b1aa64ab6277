"""What a page is made of: sections of text, tables and figures. `document.html` lays them out."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar, Final

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup
from matplotlib.figure import Figure

from quadriga.charts.files import to_svg

_TEMPLATE: Final = "document.html"


@dataclass(frozen=True, slots=True)
class Cell:
    """A text that is more than a text: a link to `href`, out of the ordinary, or code."""

    text: str
    href: str = ""
    marked: bool = False
    code: bool = False


Text = str | Cell


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Texts, one after the other; `soft` is what need not be read."""

    kind: ClassVar = "paragraph"
    texts: Sequence[Text]
    soft: bool = False


@dataclass(frozen=True, slots=True)
class Subtitle:
    """Texts above a part of a section."""

    kind: ClassVar = "subtitle"
    texts: Sequence[Text]


@dataclass(frozen=True, slots=True)
class PageTable:
    """A table.

    Attributes:
        head: headings; empty for none.
        rows: cells, each a text or several; the last of a shorter row fills it.
        named: the first cell of each row is its name.
        numbers: all cells but the first are figures.
    """

    kind: ClassVar = "table"
    head: Sequence[str]
    rows: Sequence[Sequence[Text]]
    named: bool = False
    numbers: bool = False


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure, and what it shows: a name that is unique within the page, and words below it."""

    kind: ClassVar = "drawing"
    figure: Figure
    name: str
    caption: str = ""

    @property
    def svg(self) -> Markup:
        """For the template."""
        return Markup(to_svg(self.figure, self.name))


@dataclass(frozen=True, slots=True)
class Clip:
    """Moving pictures, which become part of the page.

    Attributes:
        content: of a WebP file.
        name: what they show, for those who do not see them.
        caption: words below them.
    """

    kind: ClassVar = "clip"
    content: bytes
    name: str
    caption: str

    @property
    def source(self) -> str:
        """For the template."""
        return f"data:image/webp;base64,{b64encode(self.content).decode()}"


@dataclass(frozen=True, slots=True)
class MovingScene:
    """Moments of a walk that the reader looks at from any side.

    Attributes:
        content: JSON of `quadriga.moving_scene`.
        caption: words below it.
    """

    kind: ClassVar = "scene"
    content: str
    caption: str

    @property
    def data(self) -> Markup:
        """For the template; nothing in it ends the element in which it stands."""
        return Markup(self.content.replace("<", "\\u003c"))


@dataclass(frozen=True, slots=True)
class Fold:
    """Parts that can be folded away."""

    kind: ClassVar = "fold"
    title: str
    parts: Sequence[Part]
    opened: bool


Part = Paragraph | Subtitle | PageTable | Drawing | Clip | MovingScene | Fold


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page that links can lead to."""

    anchor: str
    title: str
    parts: Sequence[Part]


@dataclass(frozen=True, slots=True)
class Document:
    """A whole page.

    Attributes:
        title: of the page.
        lead: the first sentence.
        verdict: `good` or `bad`, which gives the lead its colour, or empty.
        notes: warnings below the lead.
        sections: in order.
        clock: whether a time is shown in all figures at once.
        moving: whether a part is a `MovingScene`.
    """

    title: str
    lead: str
    sections: Sequence[Section]
    verdict: str = ""
    notes: Sequence[str] = ()
    clock: bool = False
    moving: bool = False

    def to_html(self) -> str:
        """The page; it loads nothing from anywhere, and every text in it is escaped."""
        return _template().render(page=self)


def time_link(tick: int) -> Cell:
    """A world time that leads to itself in every figure."""
    return Cell(f"{tick / 1000:.2f} s", f"#t={tick / 1000:.3f}")


@cache
def _template() -> Template:
    environment = Environment(
        loader=PackageLoader("quadriga.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(_TEMPLATE)
