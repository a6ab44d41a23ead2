"""``paper.html``: every table and figure, paper beside ours, with what differs and why."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from airground._version import __version__
from airground.records import write_text
from airground.studies.html_page import html_page, html_table, inline_png

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from pathlib import Path

    from airground.studies.item import Item

__all__ = ["write_paper_page"]

OPENING = """\
<h1>The paper's experiments, beside ours</h1>
<p>"Calibrating an Air-Ground Control System from Motion Correspondences" (2004): every table and figure that
<code>airground reproduce</code> runs, what the paper says, what comes out here, and what differs and why.</p>
<p class="soft">airground {version}, {trials} simulated drives, seed {seed}; the same seed gives the same page.
<code>reproduce.json</code> beside this page has all numbers.</p>
<p>{contents}</p>
"""


def write_paper_page(
    out: Path,
    items: Mapping[str, Item],
    result: Mapping[str, Any],
    *,
    pictures: Collection[str],
    trials: int,
    seed: int,
) -> None:
    """Write ``paper.html``.

    Parameters
    ----------
    out : Path
        Folder with the items' pictures.
    items : mapping of str to Item
        What was run, in this order.
    result : mapping
        JSON object of each.
    pictures : collection of str
        Items that have one.
    trials : int
        Of the simulation.
    seed : int
        Of all random numbers.
    """
    sheets = {name: item.sheet(result[name]) for name, item in items.items()}
    contents = " · ".join(
        f'<a href="#{name}">{escape(_short(sheet.title))}</a>' for name, sheet in sheets.items()
    )
    parts = [
        OPENING.format(version=escape(__version__), trials=trials, seed=seed, contents=contents)
    ]
    for name, sheet in sheets.items():
        parts.append(f'<h2 id="{name}">{escape(sheet.title)}</h2>\n{html_table(sheet)}')
        parts.append(f"<p>{escape(items[name].differs)}</p>")
        if name in pictures:
            picture = inline_png(out / f"{name}.png")
            parts.append(
                f'<img class="figure" alt="{escape(sheet.title, quote=True)}" src="{picture}">'
            )
    write_text(
        out / "paper.html", html_page("The paper's experiments, beside ours", "\n".join(parts))
    )


def _short(title: str) -> str:
    return title.split(":", maxsplit=1)[0]
