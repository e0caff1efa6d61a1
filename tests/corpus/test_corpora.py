"""The bundled corpora: a body could do what they show, they say what they are, and they hang together."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from motionmind import Engine, Posture, read_posture
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.motion import Motion
from motionmind.bundled import bundled
from motionmind.corpus import store
from motionmind.corpus.manifest import SourceManifest, parse_manifest
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import played, posture
from motionmind.notation.posture_line import Row
from motionmind.notation.read import read_score
from motionmind.notation.score import Score, Setting

CORPORA = bundled("corpora")
# Of each: clips and postures at least.
SIZES = {
    "ballet": (38, 1720),
    "hands": (3, 60),
    "karate": (4, 300),
    "macarena": (1, 64),
    "medley": (1, 100),
    "walk-hexapod": (3, 60),
}
# Clips of ballet that come to rest on one leg.
STILL = ("adagio", "adagio-barre", "developpes", "promenade", "arabesques", "balances")
PEOPLE = sorted(SIZES.keys() - {"walk-hexapod"})


def manifest(name: str) -> SourceManifest:
    return parse_manifest(store.read_manifest(CORPORA / name), SourceManifest, CORPORA / name)


@pytest.fixture(scope="module")
def clips() -> dict[str, list[tuple[Score, list[Row], Motion]]]:
    """Of each corpus all clips, as rows and as movement."""
    found = {}
    for name in SIZES:
        scores = [read_score(CORPORA / name / file) for file in manifest(name).scores]
        found[name] = [(score, rows, motion) for score in scores for rows, motion in played(score)]
    return found


def test_these_are_all() -> None:
    assert {folder.name for folder in CORPORA.iterdir() if (folder / store.MANIFEST).is_file()} == set(SIZES)


@pytest.mark.parametrize("name", SIZES)
def test_says_what_it_is(name: str) -> None:
    said = manifest(name)
    assert said.name == name
    assert said.licence in ("CC0-1.0", "CC-BY-4.0")
    assert min(map(len, (said.title, said.author, said.source))) > 10
    abouts = [clip.about for file in said.scores for clip in read_score(CORPORA / name / file).clips]
    assert min(map(len, abouts)) > 10
    assert len(set(abouts)) == len(abouts)


@pytest.mark.parametrize("name", SIZES)
def test_size_and_even_time(name: str, clips: dict[str, list[tuple[Score, list[Row], Motion]]]) -> None:
    motions = [motion for _, _, motion in clips[name]]
    assert len(motions) >= SIZES[name][0]
    assert sum(map(len, motions)) >= SIZES[name][1]
    for motion in motions:
        steps = np.diff(motion.times)
        assert np.ptp(steps) < 2e-4, motion.name
        assert 0.05 <= steps[0] <= 1.0, motion.name


def test_what_the_papers_name(clips: dict[str, list[tuple[Score, list[Row], Motion]]]) -> None:
    lengths = {motion.name: len(motion) for _, _, motion in clips["ballet"]}
    assert lengths["jump"] == 7
    assert 68 in lengths.values()


@pytest.mark.parametrize("name", SIZES)
def test_anatomical_limits(name: str, clips: dict[str, list[tuple[Score, list[Row], Motion]]]) -> None:
    for score, rows, motion in clips[name]:
        anatomy = score.body
        turned = motion.rotations.copy()
        facing = rot.about_vertical(np.radians([row.face for row in rows]))
        turned[:, 0] = rot.inv_mul(facing, turned[:, 0])
        degrees = anatomy.degrees(turned)
        for index, joint in enumerate(anatomy.skeleton.names):
            for word, angle in anatomy.anatomy(joint)[1].angles.items():
                values = angle.sign * degrees[:, index, angle.axis]
                least, most = angle.range
                bad = np.flatnonzero((values < least - 0.6) | (values > most + 0.6))
                assert len(bad) == 0, f"{motion.name} {bad[:5]}: {joint} {word} {values[bad[:5]]}"


@pytest.mark.parametrize("name", SIZES)
def test_the_lowest_point_is_on_the_floor_or_as_high_as_it_is_said_to_be(
    name: str, clips: dict[str, list[tuple[Score, list[Row], Motion]]]
) -> None:
    for score, rows, motion in clips[name]:
        heights = score.body.skeleton.positions_and_tips(motion.rotations, motion.root)[..., 1].min(axis=1)
        if score.body.leg is not None:
            heights = np.minimum(heights, _feet(score, motion)[..., 1].min(axis=(1, 2)))
        meant = np.array([(row.up or 0.0) / 100.0 for row in rows])
        assert np.abs(heights - meant).max() < 0.01, motion.name


@pytest.mark.parametrize("name", PEOPLE)
def test_feet_that_bear_weight_stay_where_they_are(
    name: str, clips: dict[str, list[tuple[Score, list[Row], Motion]]]
) -> None:
    for score, rows, motion in clips[name]:
        feet = _feet(score, motion)
        for t, (before, after) in enumerate(pairwise(rows), start=1):
            legs = [row.limbs[0] for row in (before, after)]
            held = [s for s in (0, 1) if all(_bears(pair, s) for pair in legs) and not legs[1][s].get("pivot")]
            still = [s for s in held if all(legs[0][s].get(k) == legs[1][s].get(k) for k in ("out", "ahead", "turn"))]
            alone = len(held) == 1 and not any(_bears(legs[0], s) and _bears(legs[1], s) for s in {0, 1} - set(held))
            if before.up is None and after.up is None and (alone or (len(still) == 2 and before.face == after.face)):
                slip = np.linalg.norm((feet[t, held, 0] - feet[t - 1, held, 0])[:, [0, 2]], axis=-1)
                assert slip.max() < 0.005, f"{motion.name} posture {t}"


def test_weight_over_the_feet_in_still_postures_of_adagios(
    clips: dict[str, list[tuple[Score, list[Row], Motion]]],
) -> None:
    """Independent of how the legs were placed: the centre of mass against the hull of what is on the floor."""
    checked = 0
    for score, _rows, motion in clips["ballet"]:
        if motion.name not in STILL:
            continue
        still = np.flatnonzero(rot.angle(motion.rotations[1:], motion.rotations[:-1]).max(axis=1) < 1e-6) + 1
        centres = score.body.centre_of_mass(motion.rotations, motion.root)
        feet = _feet(score, motion)
        for t in still:
            points = feet[t].reshape(-1, 3)
            points = points[points[:, 1] < 0.015][:, [0, 2]]
            assert _distance(centres[t, [0, 2]], points) < 0.05, f"{motion.name} posture {t}"
            checked += 1
    assert checked >= 15


def _bears(legs: tuple[Setting, Setting], side: int) -> bool:
    """Whether a leg bears weight: its own share, or what the other one leaves."""
    mine, other = legs[side], legs[1 - side]
    left = 100.0 - other["weight"] if "stand" in other and "weight" in other else 50.0
    return "stand" in mine and mine.get("weight", left) > 0.0


def _feet(score: Score, motion: Motion) -> np.ndarray:
    """Ball, tip and heel of the left and the right foot [T, 2, 3, 3], metres."""
    skeleton = score.body.skeleton
    turned = skeleton.global_rotations(motion.rotations)
    places = skeleton.positions(motion.rotations, motion.root)
    out = np.empty((len(motion), 2, 3, 3))
    for s, side in enumerate(("left", "right")):
        toes, ankle = skeleton.index(f"{side}_toes"), skeleton.index(f"{side}_ankle")
        out[:, s, 0] = places[:, toes]
        out[:, s, 1] = places[:, toes] + rot.mul_vec(turned[:, toes], skeleton.tips[toes])
        out[:, s, 2] = places[:, ankle] + rot.mul_vec(turned[:, ankle], np.array([0.0, -0.066, -0.045]))
    return out


def _distance(point: np.ndarray, hull: np.ndarray) -> float:
    """Metres from a point to the convex hull of feet's points, widened by 2 cm for their breadth; 0 within it."""
    spread = np.concatenate([hull + offset for offset in 0.02 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])])
    return float(max(0.0, (ConvexHull(spread).equations @ [*point, 1.0]).max()))


@pytest.mark.parametrize("name", ["ballet", "karate"])
def test_states_have_names(name: str) -> None:
    engine = Engine.load(name)
    space = engine.space
    assert space.kind == "library"
    assert all(space.label(chain, 0) for chain in range(len(engine.corpus.skeleton)))
    orientations = engine.corpus.to_chains(engine.corpus.rotations)
    apart = space.distance(orientations, np.asarray(engine.states))
    assert np.quantile(apart, 0.99) <= 20.0


def test_ballet_hangs_together() -> None:
    engine = Engine.load("ballet")
    found = engine.check(2000, seed=0)
    assert found["joinable"] >= 0.95
    assert np.median(list(found["out_degree"].values())) >= 2.5


@pytest.mark.long
def test_tweens_in_ballet_are_new_and_attested() -> None:
    """At least half of the postures between random ones are in no clip, and every move of every joint is in one."""
    engine = Engine.load("ballet")
    rng, seen = np.random.default_rng(3), {row.tobytes() for row in np.asarray(engine.states)}
    new, between = 0, 0
    for _ in range(12):
        a, b = rng.integers(len(engine.corpus), size=2)
        tween = engine.tween(_posture(engine, a), _posture(engine, b), strict=True)
        assert tween.attested == 1.0 or not tween.bridges
        inner = np.asarray(tween.path[1:-1], dtype=engine.states.dtype)
        new += sum(row.tobytes() not in seen for row in inner)
        between += len(inner)
    assert between > 20
    assert new / between >= 0.5


def _posture(engine: Engine, index: int) -> Posture:
    return Posture(engine.corpus.skeleton, engine.corpus.rotations[index], engine.corpus.root[index])


def test_named_postures_are_what_the_score_says() -> None:
    folder = CORPORA / "ballet"
    score = read_score(folder / "vocabulary.score")
    files = sorted((folder / "postures").glob("*.json"))
    assert {file.stem for file in files} == set(score.postures)
    for file in files:
        kept, made = read_posture(file), posture(score, file.stem)
        assert np.abs(kept.rotations - made.rotations).max() < 2e-8
        assert np.abs(kept.root - made.root).max() < 1e-9


def test_medley_is_made_of_the_others(clips: dict[str, list[tuple[Score, list[Row], Motion]]]) -> None:
    """Of the one in sequence, nearly every posture is one of another corpus; the rest leads from piece to piece."""
    whole = next(motion.rotations[:, 1:] for _, _, motion in clips["medley"] if motion.name == "medley")
    shares = {}
    for other in ("ballet", "karate", "macarena"):
        pieces = np.concatenate([motion.rotations[:, 1:] for _, _, motion in clips[other]])
        same = [bool((rot.angle(pieces, row).max(axis=1) < 1e-6).any()) for row in whole]
        shares[other] = np.mean(same)
    assert min(shares.values()) > 0.1
    assert sum(shares.values()) > 0.7


def test_a_mirrored_score_mirrors_the_movement(tmp_path: Path) -> None:
    """Of the whole ballet: every clip done on the other side is its mirror image."""
    anatomy = anatomy_named("human23")
    names = anatomy.skeleton.names
    swap = [names.index(_opposite(name)) for name in names]
    for file in manifest("ballet").scores[:1]:
        score = read_score(CORPORA / "ballet" / file)
        lines = [f"include {CORPORA / 'ballet' / file} as there"]
        lines += [f"clip m-{clip.name}: mirrored\n  there.{clip.name}, other side" for clip in score.clips]
        mirror = tmp_path / "mirror.score"
        mirror.write_text("\n".join(lines) + "\n")
        for (_, here), (_, there) in zip(played(score), played(read_score(mirror)), strict=True):
            assert rot.angle(rot.mirror(here.rotations[:, swap]), there.rotations).max() < 1e-5
            assert np.abs(here.root * [-1.0, 1.0, 1.0] - there.root)[:, 1:].max() < 1e-3


def _opposite(name: str) -> str:
    side, _, joint = name.partition("_")
    return {"left": f"right_{joint}", "right": f"left_{joint}"}.get(side, name)


def test_kata_end_where_they_began(clips: dict[str, list[tuple[Score, list[Row], Motion]]]) -> None:
    for _, rows, motion in clips["karate"]:
        assert rows[-1].face % 360 == rows[0].face % 360, motion.name
        assert np.linalg.norm((motion.root[-1] - motion.root[0])[[0, 2]]) < 0.10, motion.name


def test_the_hand_at_the_barre_stays_at_its_height(clips: dict[str, list[tuple[Score, list[Row], Motion]]]) -> None:
    """Whatever the legs and the torso do: the barre is 1.05 m high, and nothing lifts or sinks it by a hand."""
    at_barre = 0
    for score, rows, motion in clips["ballet"]:
        skeleton = score.body.skeleton
        places = skeleton.positions(motion.rotations, motion.root)
        for side, name in enumerate(("left", "right")):
            held = [row.limbs[1][side].get(("fingers", 2)) == -38.0 for row in rows]
            heights = places[held, skeleton.index(f"{name}_fingers"), 1]
            at_barre += len(heights)
            assert np.all(np.abs(heights - 1.05) < 0.12), motion.name
    assert at_barre > 400


def test_an_insect_that_goes_slowly_could_stop_at_any_time(
    clips: dict[str, list[tuple[Score, list[Row], Motion]]],
) -> None:
    """But for the tripod gait, which is fast, the centre of mass is over the polygon of the feet on the floor."""
    for score, _, motion in clips["walk-hexapod"]:
        if motion.name == "tripod":
            continue
        skeleton = score.body.skeleton
        legs = [f"{side}_{leg}_tibia" for side in ("left", "right") for leg in ("fore", "middle", "hind")]
        ends = [len(skeleton) + skeleton.index(leg) for leg in legs]
        tips = skeleton.positions_and_tips(motion.rotations, motion.root)[:, ends]
        centres = score.body.centre_of_mass(motion.rotations, motion.root)[:, [0, 2]]
        for t, feet in enumerate(tips):
            hull = ConvexHull(feet[feet[:, 1] < 0.004][:, [0, 2]])
            assert (hull.equations @ [*centres[t], 1.0]).max() < 0.0, f"{motion.name} posture {t}"
