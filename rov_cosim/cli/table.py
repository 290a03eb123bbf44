"""Text tables for the screen."""

import re
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from textwrap import TextWrapper

_GAP = "  "
_LEAST = 20
_USUAL, _NARROWEST = 120, 7


def lines(rows: Sequence[Sequence[str]], widest: Sequence[int], width: int) -> Iterable[str]:
    """Yield the lines of a table, long cells wrapped.

    Parameters
    ----------
    rows : cells by row, as many in each; a column that is empty in all is not shown.
    widest : of each column but the last, on a screen of 120 characters, others in proportion; cells beyond are wrapped.
        The last column takes the rest.
    width : of the screen.
    """
    shown = [i for i in range(len(widest)) if any(row[i] for row in rows)]
    most = [max(wide * width // _USUAL, _NARROWEST) for wide in widest]
    columns = [min(max(len(row[i]) for row in rows), most[i]) for i in shown]
    rest = max(width - sum(columns) - len(_GAP) * len(columns), _LEAST)
    for row in rows:
        texts = [*(row[i] for i in shown), row[-1]]
        cells = [_wrapped(text, wide) for text, wide in zip(texts, [*columns, rest], strict=True)]
        for parts in zip_longest(*cells, fillvalue=""):
            yield _GAP.join(f"{part:{wide}}" for part, wide in zip(parts, [*columns, 0], strict=True)).rstrip()


def _wrapped(text: str, width: int) -> list[str]:
    wrapper = TextWrapper(width, break_on_hyphens=False)
    wrapper.wordsep_simple_re = re.compile(r"(\s+|(?<=/))")  # names of a group break between its members
    return wrapper.wrap(text)
