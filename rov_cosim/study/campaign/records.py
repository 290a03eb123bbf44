"""The table of a campaign on disk, in Parquet: in parts while it runs, each written as a whole, and then as one."""

import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ...exporters import archive
from ..scores import Score
from .draws import Table

_KEY = b"campaign"
_TEXTS = ("verdict", "reason")
_SCORES = tuple(field.name for field in fields(Score))


class Records:
    """The runs that are done, by number.

    Parameters
    ----------
    path : the whole table; its parts lie beside it until all are there.
    draws : what varies.
    digest : what tells this campaign from every other; what others left is not taken.
    warn : is told of a part that cannot be read, whose runs are done again.

    Attributes
    ----------
    scores : by number of the run.
    """

    def __init__(self, path: Path, draws: Table, digest: str, warn: Callable[[str], None]) -> None:
        self.path, self._draws, self._digest = path, draws, digest
        self.parts = path.with_name(f"{path.stem}.parts-{digest[:8]}")
        self.scores: dict[int, Score] = {}
        for file in [path, *sorted(self.parts.glob("[!.]*.parquet"))]:
            try:
                self.scores |= dict(_read(file, digest))
            except FileNotFoundError:
                continue
            except (pa.ArrowException, OSError) as error:
                warn(f"{file} cannot be read, so its runs are done again: {' '.join(str(error).split())}")

    def forget(self) -> None:
        """Remove all that is recorded."""
        self.scores.clear()
        self.path.unlink(missing_ok=True)
        shutil.rmtree(self.parts, ignore_errors=True)

    def add(self, scores: Mapping[int, Score]) -> None:
        """Keep the scores of some runs, on disk before it returns."""
        name = f"{min(scores):08d}.parquet"
        archive.put(self.parts / name, _bytes(self._table(scores), self._digest))
        self.scores |= scores

    def finish(self, passed: Mapping[int, bool]) -> None:
        """Write the whole table, the same bytes whatever the order in which the runs were done; remove the parts."""
        table = self._table({run: self.scores[run] for run in sorted(self.scores)})
        column = pa.array([passed[run] for run in sorted(self.scores)], pa.bool_())
        archive.put(self.path, _bytes(table.append_column("passed", column), self._digest))
        shutil.rmtree(self.parts, ignore_errors=True)

    def _table(self, scores: Mapping[int, Score]) -> pa.Table:
        runs = list(scores)
        columns = {"run": pa.array(runs, pa.int64())}
        columns |= {end: pa.array(column[runs].tolist()) for end, column in self._draws.items()}
        for name in _SCORES:
            type_ = pa.string() if name in _TEXTS else pa.float64()
            columns[name] = pa.array([getattr(score, name) for score in scores.values()], type_)
        return pa.table(columns)


def _bytes(table: pa.Table, digest: str) -> bytes:
    sink = pa.BufferOutputStream()
    pq.write_table(table.replace_schema_metadata({_KEY: digest}), sink)
    content: bytes = sink.getvalue().to_pybytes()
    return content


def _read(file: Path, digest: str) -> Iterator[tuple[int, Score]]:
    with file.open("rb") as opened:
        parquet = pq.ParquetFile(opened)
        if (parquet.schema_arrow.metadata or {}).get(_KEY) != digest.encode():
            return
        rows: Iterable[dict[str, Any]] = parquet.read(["run", *_SCORES]).to_pylist()
    for row in rows:
        yield row["run"], Score(**{name: row[name] for name in _SCORES})
