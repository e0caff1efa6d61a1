"""What a console shows of public values: a few lines, whatever their size and their names."""

from __future__ import annotations

from dataclasses import replace

import pytest

from motionmind import Engine, Motion, Skeleton, vary

FOREIGN = "left\x1b[31m\nhip " + "long " * 1000


@pytest.fixture(scope="module")
def engine() -> Engine:
    return Engine.load("ballet")


def _foreign(motion: Motion) -> Motion:
    body = motion.skeleton
    strange = Skeleton(FOREIGN, (FOREIGN, *body.names[1:]), body.parents, body.offsets, body.tips)
    return replace(motion, skeleton=strange, name=FOREIGN)


def test_public_values_are_shown_in_one_to_five_safe_lines(engine: Engine) -> None:
    motion = engine.corpus.motion(engine.corpus.clips[0])
    tween = engine.tween(motion.posture(0), motion.posture(3), moves=3)
    strange = _foreign(tween.motion)
    values = [
        (engine, "ballet"),
        (replace(engine.corpus, name=FOREIGN, skeleton=strange.skeleton), "left"),
        (tween, "optimal"),
        (tween.motion.insertions[0], "moves 3"),
        (motion, f"frames {len(motion)}"),
        (strange, "left"),
        (strange.posture(0), "left"),
        (strange.skeleton, "23 joints"),
        (replace(tween, motion=strange), "left"),
        (variation := vary(motion, nudge=1.0), "lorenz"),
        (replace(variation, piece=replace(variation.piece, motion=_foreign(variation.piece.motion))), "left"),
    ]
    values += [
        (engine.space, "joints 23"),
        (first := variation.seams[0], "not judged"),
        (seam := vary(motion, engine, nudge=1.0, length=first.at + 2, alternatives=1).seams[0], f"to {first.end}"),
        (seam.insertion, "nats"),
    ]
    for value, said in values:
        shown = repr(value)
        assert said in shown
        assert 1 <= len(shown.splitlines()) <= 5, shown
        assert max(map(len, shown.splitlines())) <= 240, shown
        assert "\x1b" not in shown
        assert type(value).__name__ in shown
