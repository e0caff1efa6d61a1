"""Tweens between two duet postures: how the tween command reads, finds, prints and writes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from motionmind.cli.ensembles import describe_ensemble, is_ensemble, open_ensemble, write_ensemble, write_steps
from motionmind.cli.files import check_outputs, note_licences, numbered
from motionmind.cli.printing import Interruption, print_tween, print_written
from motionmind.cli.search_options import request_options
from motionmind.cli.types import known_corpora
from motionmind.cli.warming import preparing
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.files import all_or_none, name_of
from motionmind.names.spelling import PostureName, Source, is_file

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.duets.tweening import DuetTween
    from motionmind.ensemble.dancers import Ensemble

DUETS = (".toml", ".html", ".glb", ".bvh")  # what a duet becomes
_UNSUPPORTED = (
    *("program", "rig", "report", "details", "problem", "alternatives", "is_loop", "what_if"),
    *("reach", "via", "music", "offset", "asf"),
)
_SIDES: tuple[Literal["before", "after"], ...] = "before", "after"


def are_duets(ends: Sequence[PostureName], duets: Sequence[Path]) -> bool:
    """Return whether A and B are duet postures: frames of ensembles.

    Raises:
        MotionMindError: one of them is and the other is not, or --duets is given for single bodies.
    """
    found = [_is_ensemble(end.source) for end in ends]
    if any(found) and not all(found):
        duet, one = ends if found[0] else reversed(ends)
        raise MotionMindError(f"{displayed(duet.word)} is of several dancers, and {displayed(one.word)} of one")
    if duets and not any(found):
        raise MotionMindError(f"--duets: {displayed(ends[0].word)} and {displayed(ends[1].word)} are of one dancer")
    return any(found)


def _is_ensemble(source: Source) -> bool:
    known = source.kind == "file" and not source.name and is_file(source.place)
    return known and is_ensemble(source.place, (), ())


def tween_duets(
    ends: Sequence[PostureName],
    duets: Sequence[Path],
    outputs: Sequence[Path],
    corpus: str | None,
    home: Path | None,
    options: dict[str, Any],
    reading: dict[str, Any],
) -> None:
    """Find, print and write the tween between two duet postures.

    Args:
        ends: their names.
        duets: files to learn the couple from; empty for those of A and B.
        outputs: the files to write.
        corpus: the corpus; None if none is given.
        home: the folder of the user's corpora; None for the default folder.
        options: the leader's options.
        reading: values of the options that `options.reading` adds.

    Raises:
        MotionMindError: an option is not for duets, or a file cannot be read or written.
    """
    if corpus is None:
        raise click.UsageError(
            f"Missing option '--corpus': duet postures are in files. Corpora: {known_corpora(home)}",
            click.get_current_context(),
        )
    from motionmind.cli.postures import read_end
    from motionmind.corpus.store import locate
    from motionmind.duets.tweening import tween_duet
    from motionmind.ensemble.dancers import Dancer, Ensemble
    from motionmind.formats import read_motion
    from motionmind.formats.floor_path import read_floor_path
    from motionmind.tween.engine import Engine

    locate(corpus, home)
    path = options.pop("along")
    request = request_options(options, home, read_motion)
    request |= {"to": options["to"], "along": None if path is None else read_floor_path(path)}
    files = list(dict.fromkeys([end.source.place for end in ends] + [str(path) for path in duets]))
    ensembles = {file: _open(file, outputs, home, reading) for file in files}
    check_outputs([(file, ()) for file in _written(outputs)], [Path(file) for file in files])
    bodies = {file: _bodies(ensemble) for file, ensemble in ensembles.items()}
    learned = [bodies[file] for file in ([str(path) for path in duets] or files) if len(bodies[file][0]) > 1]
    before, after = (
        [read_end(end, side, home, partial(_given, body)) for body in bodies[end.source.place]]
        for end, side in zip(ends, _SIDES, strict=True)
    )
    with preparing():
        engine = Engine.load(corpus, home)
        with Interruption() as interruption:
            result = tween_duet(
                engine,
                (before[0][0], before[1][0]),
                (after[0][0], after[1][0]),
                learned,
                before=(before[0][1], before[1][1]),
                after=(after[0][1], after[1][1]),
                watch=interruption.watch,
                **request,
            )
    places = [(float(one.root[0, 0]), float(one.root[0, 2])) for one in result.motions]
    names = [dancer.name for dancer in ensembles[ends[0].source.place].dancers]
    couple = Ensemble("", tuple(map(Dancer, names, result.motions, places)))
    written = _write(result, couple, outputs)
    _print(result, couple, written)
    interruption.finish()


def _given(body: Motion, _: Path | str) -> Motion:
    return body


def _open(file: str, outputs: Sequence[Path], home: Path | None, reading: dict[str, Any]) -> Ensemble:
    """Read an ensemble of two dancers."""
    options = {name: value for name, value in reading.items() if name != "asf"}
    ensemble = open_ensemble(file, outputs, DUETS, home, _UNSUPPORTED, lambda _: _written(outputs), **options, asf=None)
    if len(ensemble.dancers) != 2:
        raise MotionMindError(f"{displayed(file)}: a duet has two dancers, not {len(ensemble.dancers)}")
    one, other = (dancer.piece.skeleton for dancer in ensemble.dancers)
    if difference := one.difference(other):
        names = " and ".join(displayed(dancer.name) for dancer in ensemble.dancers)
        raise MotionMindError(f"{displayed(file)}: {names} have different joints: {difference}")
    return ensemble


def _bodies(ensemble: Ensemble) -> tuple[Motion, Motion]:
    """Return the movement of leader and follower on one clock: of a BVH file, in its own frames."""
    pieces = [dancer.piece for dancer in ensemble.dancers]
    is_bvh = all(".bvh#" in dancer.source.lower() for dancer in ensemble.dancers)
    first, second = ensemble.motions(pieces[0].times - pieces[0].times[0] if is_bvh else None)
    return first, second


def _written(outputs: Sequence[Path]) -> list[Path]:
    """Return the files that the outputs become: a .bvh one for each dancer, a .toml with one for each."""
    files = [path for path in outputs if path.suffix.lower() != ".bvh"]
    for path in outputs:
        if path.suffix.lower() in (".bvh", ".toml"):
            files += _own_files(path)
    return files


def _own_files(path: Path) -> list[Path]:
    suffix = ".json" if path.suffix.lower() == ".toml" else path.suffix
    return [numbered(path.with_suffix(suffix), number, 2) for number in (1, 2)]


def _write(result: DuetTween, couple: Ensemble, outputs: Sequence[Path]) -> list[Path]:
    """Write a duet to all outputs, or to none if one fails; return the files."""
    from motionmind.formats.bvh import write_bvh
    from motionmind.formats.glb import write_group_glb
    from motionmind.render.group_page import write_group_page

    with all_or_none():
        for path in outputs:
            ensemble = replace(couple, name=name_of(path))
            for motion in result.motions:
                note_licences(path, motion)
            match path.suffix.lower():
                case ".toml":
                    write_ensemble(str(path), path, write_steps(path, _own_files(path), ensemble))
                case ".html":
                    write_group_page(path, ensemble)
                case ".glb":
                    write_group_glb(path, ensemble.motions(result.leader.motion.times))
                case _:
                    for file, motion in zip(_own_files(path), result.motions, strict=True):
                        write_bvh(file, motion)
    return _written(outputs)


def _print(result: DuetTween, couple: Ensemble, files: Sequence[Path]) -> None:
    """Print both tweens, and how the couple keeps together."""
    near, far = result.distances
    learned = "" if result.usual is None else f"; {result.usual[0]:.2f} to {result.usual[1]:.2f} m in the duets"
    deviation = result.deviation
    held = "no hands held" if deviation.hand is None else f"held hands up to {100.0 * deviation.hand:.1f} cm off"
    for who, one in (("leader", result.leader), ("follower", result.follower)):
        click.echo(f"{who}:")
        print_tween(one, None)
    click.echo(
        f"couple    {near:.2f} to {far:.2f} m apart{learned}\n"
        f"follower  up to {100.0 * deviation.place:.0f} cm and {deviation.facing:.0f} degrees from its place; {held}"
    )
    if result.usual is not None:
        click.echo(f"relations {100.0 * result.path.attested:.0f}% of their moves occur in the duets")
    for line in describe_ensemble(couple)[1:]:
        click.echo(line)
    print_written(files)
