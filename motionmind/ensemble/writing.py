"""Ensembles written as files in which every dancer's piece, place, facing and entry are given."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motionmind.ensemble.changes import whereabouts
from motionmind.ensemble.dancers import Ensemble
from motionmind.files import format_toml_string
from motionmind.tween.counts import counts_to_seconds, seconds_to_count


def format_ensemble(ensemble: Ensemble, piece: Callable[[str], str]) -> str:
    """Return an ensemble's file, in TOML; `read_ensemble` reads the same dancers from it.

    Args:
        ensemble: the dancers.
        piece: returns the name or the path of a piece for the file, from that in the ensemble's own file.
    """
    lines = [] if ensemble.tempo is None else [f"tempo = {ensemble.tempo!r}"]
    if ensemble.piece_tempo is not None:
        lines.append(f"piece_tempo = {ensemble.piece_tempo!r}")
    if ensemble.stage is not None:
        lines.append(f"stage = {[*map(float, ensemble.stage)]}")
    for dancer in ensemble.dancers:
        lines += [
            "",
            "[[dancer]]",
            f"name = {format_toml_string(dancer.name)}",
            f"piece = {format_toml_string(piece(dancer.source))}",
            f"place = {_rounded(dancer.place)}",
            f"facing = {round(float(np.degrees(dancer.facing)), 9)}",
        ]
        if dancer.is_mirrored:
            lines.append("mirrored = true")
        if ensemble.tempo is not None:
            lines.append(f"entry = {round(seconds_to_count(dancer.entry, ensemble.tempo), 9)}")
    tempo = ensemble.tempo or 60.0
    for way in ensemble.dancers[0].ways:  # of one change for all
        lines += [
            "",
            "[[change]]",
            f"at = {round(seconds_to_count(way.start, tempo), 9)}",
            f"counts = {round((way.end - way.start) / counts_to_seconds(1.0, tempo), 9)}",
            f"places = {[_rounded(place) for place in whereabouts(ensemble.dancers, way.end).tolist()]}",
        ]
    return "\n".join(lines).strip() + "\n"


def _rounded(place: tuple[float, float] | list[float]) -> list[float]:
    return [round(value, 9) for value in place]
