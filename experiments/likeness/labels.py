"""Folders of what methods made of the same windows, by label, and of the rows measured of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from experiments.harness import Row
from experiments.likeness.filled import RIVALS, Filled
from experiments.likeness.measure import Truth, rows_of

MEASURING = ("classify", "features", "filled", "measure", "windows")  # modules that rows depend on


@dataclass(frozen=True)
class Labels:
    """A folder with the files of each label: the movement, what made it, and rows measured of it.

    A folder in it has the movement that classifiers learn from, fold by fold.

    Attributes:
        folder: where they are.
    """

    folder: Path

    def missing(self, label: str | None, about: dict[str, Any], again: bool) -> list[str]:
        """Return the rivals that are not there, and the label unless it was made already in the same way.

        Raises:
            click.UsageError: it was made in another way, and is not to be made again.
        """
        kept = self.folder / f"{label}.about"
        if label and not again and kept.exists() and json.loads(kept.read_text()) != about:
            raise click.UsageError(f"{label} was made with other options or code: use --again or another label")
        wanted = [*RIVALS, *([label] if label else [])]
        return [kind for kind in wanted if (again and kind == label) or not self._path(kind).exists()]

    def keep(self, kind: str, filled: Filled, about: dict[str, Any]) -> None:
        """Write what a method made and, unless it is a rival, what made it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        filled.save(self._path(kind))
        self._practice(kind).unlink(missing_ok=True)
        if kind not in RIVALS:
            (self.folder / f"{kind}.about").write_text(json.dumps(about))

    def unpractised(self, label: str | None) -> list[str]:
        """Return the rivals, and the label, without movement that classifiers learn from."""
        wanted = [*RIVALS, *([label] if label else [])]
        return [kind for kind in wanted if not self._practice(kind).exists()]

    def keep_practice(self, kind: str, folds: Sequence[Filled]) -> None:
        """Write what a method made for classifiers to learn from, fold by fold."""
        Filled.joined(folds).save(self._practice(kind))

    def rows(self, name: str, truth: Truth) -> list[Row]:
        """Return the rows of all labels, the rivals first, then the oldest; measured anew if the measures changed."""
        paths = sorted(self.folder.glob("*.npz"), key=lambda path: path.stat().st_mtime_ns)
        order = {kind: k for k, kind in enumerate(RIVALS)}
        paths.sort(key=lambda path: order.get(path.stem, len(order)))
        out: list[Row] = []
        for path in paths:
            rows, practice = path.with_name(f"{path.stem}.json"), self._practice(path.stem)
            stamp = [_MEASURED_BY, *(one.stat().st_mtime_ns for one in (path, practice) if one.exists())]
            found = json.loads(rows.read_text()) if rows.exists() else {}
            if found.get("of") != stamp:
                count = max(truth.folds.values(), default=0) + 1
                folds = Filled.load(practice).split(count) if practice.exists() else None
                found = {"of": stamp, "rows": rows_of(name, path.stem, truth, Filled.load(path), folds)}
                rows.write_text(json.dumps(found))
            out += found["rows"]
        return out

    def _path(self, kind: str) -> Path:
        return self.folder / f"{kind}.npz"

    def _practice(self, kind: str) -> Path:
        return self.folder / "practice" / f"{kind}.npz"


def code_of(folder: Path) -> str:
    """Return a digest of all Python modules in a folder."""
    return _digest(sorted(folder.rglob("*.py")))


def _digest(paths: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


_MEASURED_BY = _digest(Path(__file__).with_name(f"{name}.py") for name in MEASURING)
