"""Tables that stay whole where the terminal is narrow: their rows become columns, in as many parts as it takes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from trivet.views.layout import table

_UNBOUNDED = 1_000_000
"""Letters; of a terminal that is wide enough for anything."""


class Fitted:
    """A table as wide as it likes to be; where there is less room, its columns as rows, a part of its rows at a time."""

    def __init__(self, whole: Table, *, names: int = 1, first: int = 0, rest: str = "", note: str = "") -> None:
        """What is shown, and in which parts.

        Args:
            whole: the table; a line break in a heading is a comma where it becomes the name of a row.
            names: so many columns at its left tell which row it is.
            first: so many columns after these stay together as a table, where there is room for that.
            rest: the title of the columns after these.
            note: a line below.
        """
        self.whole, self._names, self._first, self._rest, self._note = whole, names, first, rest, note

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        for k, part in enumerate(self._parts(console, options.max_width)):
            if k:
                yield Text()
            yield part
        if self._note:
            yield Text(self._note)

    def _parts(self, console: Console, width: int) -> Iterator[Table]:
        columns = range(self._names, len(self.whole.columns))
        title = str(self.whole.title)
        if _wide(console, self.whole) <= width:
            yield self.whole
            return
        if self._first:
            together = self._some(title, columns[: self._first])
            if _wide(console, together) <= width:
                yield together
                columns, title = columns[self._first :], self._rest
        shown = 0
        while shown < self.whole.row_count:
            fits = [n for n in range(shown + 1, self.whole.row_count + 1)
                    if _wide(console, self._turned(title, columns, range(shown, n))) <= width]  # fmt: skip
            until = max(fits, default=shown + 1)
            yield self._turned(title if not shown else "", columns, range(shown, until))
            shown = until

    def _some(self, title: str, columns: Sequence[int]) -> Table:
        """Some of the columns, after the names."""
        own = [*range(self._names), *columns]
        made = table(title, *(str(self.whole.columns[k].header) for k in own), left=self._names)
        for row in zip(*(self.whole.columns[k].cells for k in own), strict=True):
            made.add_row(*row)
        return made

    def _turned(self, title: str, columns: Sequence[int], rows: Sequence[int]) -> Table:
        """Some of the rows as columns."""
        cells = [[str(cell) for cell in column.cells] for column in self.whole.columns]
        heads = ["\n".join(filter(None, (cells[k][row] for k in range(self._names)))) for row in rows]
        made = table(title, "", *heads)
        for k in columns:
            name = ", ".join(str(self.whole.columns[k].header).split("\n"))
            made.add_row(name, *(cells[k][row] for row in rows))
        return made


def _wide(console: Console, made: Table) -> int:
    """Letters that a table asks for, so that nothing in it is broken or cut."""
    return Measurement.get(console, console.options.update(max_width=_UNBOUNDED), made).maximum
