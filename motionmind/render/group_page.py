"""The page that plays an ensemble: each piece once, and each dancer by its piece, place, facing and entry."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from motionmind.body.mirror import MIDDLE, mirrored
from motionmind.credits.credit import add_up
from motionmind.credits.ledger import ledger_of, sections_of
from motionmind.display import displayed
from motionmind.ensemble.dancers import Dancer, Ensemble
from motionmind.files import FilePath, write_atomically
from motionmind.music.sound import Sound
from motionmind.render.page import fill_page, player_data, sound_data, stage_data
from motionmind.render.palette import COLOURS, dancer_ink


def write_group_page(path: FilePath, ensemble: Ensemble, sound: Sound | None = None) -> None:
    """Write the page that plays an ensemble, with the edge of its stage on the floor.

    Args:
        path: the file.
        ensemble: the dancers.
        sound: sound that begins with the ensemble; the page holds as much of it as the ensemble lasts.

    Raises:
        MotionMindError: the file cannot be written, the ensemble has too many frames, or the sound is too large.
    """
    data = _group_data(ensemble) | stage_data(ensemble.stage) | sound_data(ensemble.name, ensemble.seconds, sound)
    write_atomically(path, fill_page(ensemble.name, data, "main").encode())


def dancer_data(number: int, dancer: Dancer) -> dict[str, Any]:
    """Return the data of a dancer, without its piece, for the player; `number` counts from 0."""
    return {
        "name": displayed(dancer.name),
        "colour": dancer_ink(number),
        "place": dancer.place,
        "facing": dancer.facing,
        "entry": dancer.entry,
        "ways": [(way.start, way.end, *way.shift) for way in dancer.ways],
    }


def paints(dancers: int) -> list[dict[str, Any]]:
    """Return the paints of each of so many dancers' bodies."""
    return [COLOURS | {MIDDLE: dancer_ink(number)} for number in range(dancers)]


def _group_data(ensemble: Ensemble) -> dict[str, Any]:
    """Build the data that the player reads, as documented in player/README.md."""
    pieces: dict[tuple[int, bool], dict[str, Any]] = {}
    dancers, colours = [], {}
    for number, dancer in enumerate(ensemble.dancers):
        key = id(dancer.piece), dancer.is_mirrored
        if key not in pieces:
            pieces[key] = player_data(mirrored(dancer.piece) if dancer.is_mirrored else dancer.piece)
            colours = pieces[key].pop("colours")
        dancers.append(dancer_data(number, dancer) | {"piece": [*pieces].index(key)})
    times = ensemble.times()
    motions = [dancer.piece for dancer in ensemble.dancers]
    parts = add_up(replace(one, share=one.share / len(motions)) for motion in motions for one in motion.credits)
    return {
        "name": displayed(ensemble.name),
        "dancers": dancers,
        "pieces": [*pieces.values()],
        "colours": {**colours, "dancers": paints(len(dancers))},
        "frames": len(times),
        "rate": 1.0 / (times[1] - times[0]),
        "credits": sections_of(ledger_of(parts)) if any(one.insertions or one.recorded for one in motions) else {},
    }
