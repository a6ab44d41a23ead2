"""Tables of results as data: for the terminal, and for docs/paper.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["Sheet", "markdown", "rich_table"]


@dataclass(frozen=True, slots=True)
class Sheet:
    """A table of text, with a remark."""

    title: str
    """What the table shows."""

    header: tuple[str, ...]
    """Of each column."""

    rows: tuple[tuple[str, ...], ...]
    """As many entries as the header has, each."""

    note: str = ""
    """Below the table."""


def rich_table(sheet: Sheet) -> Table:
    """Give a table for the terminal.

    Parameters
    ----------
    sheet : Sheet
        What to show.

    Returns
    -------
    table : Table
        To be printed on a rich console.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    # As Text, since rich reads "[px/s]" in a string as markup.
    table = Table(
        box=SIMPLE_HEAD,
        title=Text(sheet.title),
        title_justify="left",
        title_style="bold",
        caption=Text(sheet.note) if sheet.note else None,
        caption_justify="left",
        pad_edge=False,
        min_width=len(sheet.title),  # or rich would break the title
    )
    for k, name in enumerate(sheet.header):
        table.add_column(Text(name), justify="left" if k == 0 else "right", no_wrap=k > 0)
    for row in sheet.rows:
        table.add_row(*(Text(entry) for entry in row))
    return table


def markdown(sheet: Sheet) -> str:
    """Give a table for a page of documentation.

    Parameters
    ----------
    sheet : Sheet
        What to show; its title and note are left to the page.

    Returns
    -------
    text : str
        Lines of a Markdown table.
    """
    rule = ["---", *("--:" for _ in sheet.header[1:])]
    return "\n".join("| " + " | ".join(row) + " |" for row in (sheet.header, rule, *sheet.rows))
