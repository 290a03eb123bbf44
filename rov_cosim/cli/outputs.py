"""Where a command writes: the place is tried before the work, which may take minutes."""

import os
from pathlib import Path
from tempfile import TemporaryFile

import click


class Place(click.Path):
    """The path of a folder, or of a file of some suffixes, to write; folders that are missing are made."""

    def __init__(self, *suffixes: str) -> None:
        super().__init__(file_okay=bool(suffixes), dir_okay=not suffixes, writable=True, path_type=Path)
        self._suffixes = suffixes

    def convert(
        self,
        value: str | os.PathLike[str],
        parameter: click.Parameter | None,
        context: click.Context | None,
    ) -> Path:
        """Return the path."""
        path = Path(str(super().convert(value, parameter, context)))
        if self._suffixes and path.suffix not in self._suffixes:
            self.fail(f"expected a name that ends in {' or '.join(self._suffixes)}, got {path}")
        if context is None or not context.resilient_parsing:  # which is for completion
            folder = path.parent if self._suffixes else path
            try:
                folder.mkdir(parents=True, exist_ok=True)
                with TemporaryFile(dir=folder):  # permissions alone do not tell
                    pass
            except OSError as error:
                self.fail(f"{path} cannot be written ({error.strerror}): name one where you may write.")
        return path


FOLDER = Place()
