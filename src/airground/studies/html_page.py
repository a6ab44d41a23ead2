"""Pages that are one file: pictures in them, no script, readable in light and dark and on a phone."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from airground.studies.sheet import Sheet

__all__ = ["html_page", "html_table", "inline_png"]

STYLE = """\
:root { color-scheme: light dark; --ink: #1c2530; --soft: #5b6774; --paper: #fff; --line: #d8dee5;
  --accent: #0b6e99; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6ebf0; --soft: #9aa7b4; --paper: #12171d; --line: #2c3640; --accent: #58b7e0; }
}
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 62rem; padding: 2rem 1.25rem 4rem; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0; }
h2 { font-size: 1.2rem; margin: 2.4rem 0 .4rem; }
p { max-width: 46rem; margin: .4rem 0 1rem; }
a { color: var(--accent); }
.soft { color: var(--soft); }
.wide { overflow-x: auto; margin: .4rem 0 1rem; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .45rem .9rem .45rem 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
td.soft { min-width: 16rem; }
td.number { font-variant-numeric: tabular-nums; white-space: nowrap; }
table.figures { width: auto; }
table.figures :is(th, td) { padding-right: 1.6rem; }
table.figures :is(th, td):not(:first-child) { text-align: right; }
table.figures th { vertical-align: bottom; }
th { font-weight: 600; color: var(--soft); }
img { display: block; width: 100%; height: auto; border: 1px solid var(--line); border-radius: 6px;
  background: #fff; }
img.figure { width: min(100%, 48rem); }
details { margin: .4rem 0 1rem; }
summary { cursor: pointer; }
li { overflow-wrap: anywhere; }
code { font-size: .92em; color: var(--accent); }"""

PAGE = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
{style}
</style>
</head>
<body>
{body}
</body>
</html>
"""


def html_page(title: str, body: str) -> str:
    """Put a page around its body.

    Parameters
    ----------
    title : str
        For the browser's tab.
    body : str
        HTML.

    Returns
    -------
    page : str
        A whole document.
    """
    return PAGE.format(title=escape(title), style=STYLE, body=body)


def html_table(sheet: Sheet) -> str:
    """Give a table and its note; the title is left to the page.

    Parameters
    ----------
    sheet : Sheet
        What to show.

    Returns
    -------
    html : str
        It scrolls sideways where it is too wide. A note of several lines is folded away.
    """
    parts = []
    if sheet.rows:
        head = "".join(f"<th>{escape(name)}</th>" for name in sheet.header)
        rows = "\n".join(
            "<tr>"
            + "".join(
                f'<td class="number">{escape(entry)}</td>' if k else f"<td>{_breakable(entry)}</td>"
                for k, entry in enumerate(row)
            )
            + "</tr>"
            for row in sheet.rows
        )
        parts.append(
            f'<div class="wide"><table class="figures">\n<tr>{head}</tr>\n{rows}\n</table></div>'
        )
    lines = sheet.note.splitlines()
    if len(lines) > 1:
        items = "\n".join(f"<li>{escape(line)}</li>" for line in lines)
        parts.append(
            f'<details class="soft"><summary>{len(lines)} remarks</summary><ul>\n{items}\n</ul></details>'
        )
    elif lines:
        parts.append(f'<p class="soft">{escape(lines[0])}</p>')
    return "\n".join(parts)


def _breakable(name: str) -> str:
    """A name of a file may go on in the next line after a slash or an underscore."""
    return escape(name).replace("/", "/<wbr>").replace("_", "_<wbr>")


def inline_png(path: Path) -> str:
    """Give a picture as an address that holds it.

    Parameters
    ----------
    path : Path
        A PNG.

    Returns
    -------
    uri : str
        For ``src``.
    """
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()
