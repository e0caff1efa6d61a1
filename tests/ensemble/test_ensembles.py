"""Ensembles: where dancers stand, when they dance, how near they come, and what no file may say."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from PIL import Image, ImageSequence

from motionmind import read_motion
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.ensemble.changes import assigned
from motionmind.ensemble.dancers import Dancer, Ensemble, find_approaches
from motionmind.ensemble.formations import FORMATIONS, places_in
from motionmind.ensemble.reading import MAX_DANCERS, read_ensemble
from motionmind.errors import FormatError
from motionmind.geometry import rotations as rot
from motionmind.plots import draw_floor_plan
from motionmind.plots.marks import Line, Words
from motionmind.render.group import GroupStage
from motionmind.render.palette import dancer_ink

PIECE = ballet_clip("temps-lie")


def canon(count: int = 3, beat: float = 2.0) -> Ensemble:
    places = places_in("line", count, 2.0)
    dancers = (Dancer(f"d{i}", PIECE, (float(x), float(z)), 0.0, beat * i) for i, (x, z) in enumerate(places))
    return Ensemble("canon", tuple(dancers), 60.0)


@pytest.mark.parametrize("formation", FORMATIONS)
@pytest.mark.parametrize("count", [1, 2, 3, 4, 7, 12])
def test_neighbours_of_a_formation_are_as_far_apart_as_asked(formation: str, count: int) -> None:
    places = places_in(formation, count, 1.5)
    assert places.shape == (count, 2)
    apart = [float(np.linalg.norm(places[i] - places[k])) for i, k in combinations(range(count), 2)]
    assert not apart or min(apart) == pytest.approx(1.5)


@pytest.mark.parametrize("formation", ["line", "circle"])
def test_a_formation_is_around_the_origin(formation: str) -> None:
    np.testing.assert_allclose(places_in(formation, 5, 2.0).mean(axis=0), 0.0, atol=1e-12)


@pytest.mark.parametrize("degrees", [0.0, 90.0, -150.0])
@pytest.mark.parametrize("is_mirrored", [False, True])
def test_a_dancer_begins_at_the_place_turned_about_it(degrees: float, is_mirrored: bool) -> None:
    dancer = Dancer("a", PIECE, (3.0, -2.0), np.radians(degrees), 1.5, is_mirrored)
    placed, piece = dancer.placed(), mirrored(PIECE) if is_mirrored else PIECE
    np.testing.assert_allclose(placed.root[0, [0, 2]], [3.0, -2.0], atol=1e-12)
    assert placed.times[0] == pytest.approx(1.5)
    assert placed.times[-1] == pytest.approx(dancer.end)
    back = rot.about_vertical(-np.radians(degrees))
    same = rot.mul_vec(back, placed.positions() - placed.root[0])
    np.testing.assert_allclose(same, piece.positions() - piece.root[0], atol=1e-6)


def test_dancers_of_a_canon_do_the_same_later_and_stand_still_before_and_after() -> None:
    ensemble = canon()
    motions = ensemble.motions()
    times = motions[0].times
    assert all(np.array_equal(one.times, times) for one in motions)
    assert times[-1] >= ensemble.seconds - 0.5 / 25.0
    later = round(2.0 * motions[0].fps)
    np.testing.assert_allclose(motions[1].rotations[later:], motions[0].rotations[:-later], atol=1e-9)
    assert (motions[2].rotations[: 2 * later] == motions[2].rotations[0]).all()
    assert (motions[0].root[-later:] == motions[0].root[-1]).all()


@pytest.mark.parametrize("seed", range(4))
def test_the_closest_approach_is_the_least_distance_of_all_joints_and_frames(seed: int) -> None:
    rng = np.random.default_rng(seed)
    dancers = [
        Dancer(f"d{i}", PIECE, (float(x), float(z)), float(rng.uniform(0, 6)), float(rng.uniform(0, 5)))
        for i, (x, z) in enumerate(rng.uniform(-1.5, 1.5, (3, 2)))
    ]
    motions = Ensemble("e", tuple(dancers)).motions(np.arange(0.0, 20.0, 0.25))
    found = {one.names: one for one in find_approaches(motions)}
    for one, other in combinations(motions, 2):
        apart = np.linalg.norm(one.positions()[:, :, None] - other.positions()[:, None], axis=-1).min(axis=(1, 2))
        approach = found[one.name, other.name]
        assert approach.metres == pytest.approx(float(apart.min()))
        assert approach.seconds == pytest.approx(float(one.times[apart.argmin()]))
    assert [one.metres for one in find_approaches(motions)] == sorted(one.metres for one in found.values())


def read_text(folder: Path, text: str) -> Ensemble:
    path = folder / "group.toml"
    path.write_text(text, "utf-8")
    pieces: list[str] = []

    def read(piece: str) -> Motion:
        pieces.append(piece)
        return PIECE

    ensemble = read_ensemble(path, read)
    assert len(pieces) == len(set(pieces)), "a piece is read once"
    return ensemble


def test_a_file_gives_common_values_and_each_dancer_its_own(tmp_path: Path) -> None:
    text = 'piece = "p"\ntempo = 120\ncanon = 4\nspacing = 2.0\nstage = [8, 6]\nfacing = "centre"\n'
    text += '[[dancer]]\n[[dancer]]\nname = "Ben"\nfacing = 90\nentry = 2\n'
    text += "[[dancer]]\nplace = [0.0, 3.0]\nmirrored = true\n"
    ensemble = read_text(tmp_path, text)
    one, ben, last = ensemble.dancers
    assert (ensemble.name, ensemble.tempo, ensemble.stage) == ("group", 120.0, (8.0, 6.0))
    assert [dancer.name for dancer in ensemble.dancers] == ["dancer 1", "Ben", "dancer 3"]
    assert [dancer.entry for dancer in ensemble.dancers] == [0.0, 0.5, 4.0]
    assert (one.place, ben.place, last.place) == ((-2.0, 0.0), (0.0, 0.0), (0.0, 3.0))
    assert ben.facing == pytest.approx(np.radians(90.0))
    assert last.is_mirrored
    middle = np.mean([dancer.place for dancer in ensemble.dancers], axis=0)
    ahead = np.array([np.sin(one.facing), np.cos(one.facing)])
    assert ahead @ (middle - one.place) == pytest.approx(np.linalg.norm(middle - one.place))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "dancer"),
        ("[[dancer]]", "dancer 1 has no piece"),
        ('piece = "p"\ncanon = 4\n[[dancer]]', "need a tempo"),
        ('piece = "p"\ntempo = 0\n[[dancer]]', "tempo"),
        ('piece = "p"\npiece_tempo = 120\n[[dancer]]', "needs the tempo to dance them in"),
        ('piece = "p"\ntempo = nan\n[[dancer]]', "tempo"),
        ('piece = "p"\nstage = [0.2, 6]\n[[dancer]]', "stage"),
        ('piece = "p"\nformation = "star"\n[[dancer]]', "star"),
        ('piece = "p"\nspacing = 0\n[[dancer]]', "spacing"),
        ('piece = "p"\nhue = 1\n[[dancer]]', "hue"),
        ('piece = "p"\n[[dancer]]\nplace = [1, 1]\n[[dancer]]\nplace = [1, 1]', "begin on one spot, 1, 1"),
        ('piece = "p"\n[[dancer]]\nname = "A"\n[[dancer]]\nname = "A"', "two dancers are named A"),
        ('piece = "group.toml"\n[[dancer]]', "dancer 1 dances group.toml, the ensemble itself"),
        ('piece = "other.toml"\n[[dancer]]', "is an ensemble"),
        ('piece = "p"\ntempo = 60\ncanon = 2\nunison = true\n[[dancer]]', "leave out canon and entry"),
        ('piece = "p"\ntempo = 60\n[[dancer]]\n[[change]]\nat = 3\ncounts = 2', "change 1 needs a formation"),
        ('piece = "p"\n[[dancer]]\n[[change]]\nat = 3\ncounts = 2\nformation = "V"', "need a tempo"),
        ('piece = "p"\ntempo = 60\n[[dancer]]\n' + 2 * '[[change]]\nat = 3\ncounts = 2\nformation = "V"\n', "at 5"),
        ('piece = "p"\ntempo = 60\n[[dancer]]\n[[change]]\nat = 3\ncounts = 2\nplaces = []', "0 places for 1"),
        (
            'piece = "p"\ntempo = 60\n[[dancer]]\n[[dancer]]\n[[change]]\nat = 3\ncounts = 2\n'
            "places = [[1, 2], [1, 2]]",
            "change 1: dancer 1 and dancer 2 end on one spot, 1, 2",
        ),
        ('piece = "p"\n[[dancer]]\nentry = 0.5', "entry"),
        ('piece = "p"\n[[dancer]]\nplace = [inf, 0]', "place"),
        ('piece = "p"\n' + (MAX_DANCERS + 1) * "[[dancer]]\n", "dancer"),
        ("piece = ", "Invalid value"),
    ],
)
def test_what_makes_no_ensemble_is_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(FormatError, match=words) as caught:
        read_text(tmp_path, text)
    assert "group.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_words_for_unison_mirror_and_facing_each_other(tmp_path: Path) -> None:
    text = 'piece = "p"\ntempo = 60\nunison = true\nmirror = true\nfacing = "each other"\n'
    one, other, middle = read_text(tmp_path, text + 3 * "[[dancer]]\n").dancers
    assert [dancer.entry for dancer in (one, other, middle)] == [0.0, 0.0, 0.0]
    assert [dancer.is_mirrored for dancer in (one, other, middle)] == [False, False, True]
    for dancer, partner in ((one, other), (other, one)):
        ahead = np.array([np.sin(dancer.facing), np.cos(dancer.facing)])
        way = np.subtract(partner.place, dancer.place)
        assert ahead @ way == pytest.approx(np.linalg.norm(way))


def test_pieces_are_stretched_to_the_tempo(tmp_path: Path) -> None:
    (dancer,) = read_text(tmp_path, 'piece = "p"\ntempo = 108\npiece_tempo = 120\n[[dancer]]\n').dancers
    counts = (PIECE.times - PIECE.times[0]) * 120.0 / 60.0
    np.testing.assert_allclose((dancer.piece.times - dancer.piece.times[0]) * 108.0 / 60.0, counts, atol=1e-9)
    assert np.array_equal(dancer.piece.rotations, PIECE.rotations)


CHANGE = 'piece = "p"\ntempo = 60\ncanon = 2\nspacing = 1.6\n' + 6 * "[[dancer]]\n"


def test_a_change_may_begin_as_the_last_one_ends_up_to_rounding(tmp_path: Path) -> None:
    change = '[[change]]\nat = {}\ncounts = 0.1\nformation = "line"\n'
    assert 1.1 + 0.1 > 1.2
    text = 'piece = "ballet/plies"\ntempo = 60\n[[dancer]]\n[[dancer]]\n'
    assert len(read_text(tmp_path, text + change.format(1.1) + change.format(1.2)).dancers[0].ways) == 2
    with pytest.raises(FormatError, match=r"change 2 begins at count 1\.19, before the last one has ended at 1\.2"):
        read_text(tmp_path, text + change.format(1.1) + change.format(1.19))


def test_a_change_ends_in_its_formation_and_the_piece_waits(tmp_path: Path) -> None:
    plain = read_text(tmp_path, CHANGE)
    changed = read_text(tmp_path, CHANGE + '[[change]]\nat = 6\ncounts = 4\nformation = "circle"\nspacing = 1.8\n')
    assert changed.seconds == pytest.approx(plain.seconds), "the last enters after the change"
    assert changed.dancers[0].end == pytest.approx(plain.dancers[0].end + 4.0)
    times = np.arange(0.0, 9.001, 0.25)
    before, after = plain.motions(times), changed.motions(times)
    ends = np.array([motion.root[-1, [0, 2]] for motion in after])
    apart = [float(np.linalg.norm(one - other)) for one, other in combinations(ends, 2)]
    assert min(apart) == pytest.approx(1.8)
    out, back = times <= 5.0, times >= 5.0
    for one, other, dancer in zip(before, after, changed.dancers, strict=True):
        np.testing.assert_allclose(other.rotations[out], one.rotations[out], atol=1e-12)
        assert (np.ptp(other.rotations[back], axis=0) < 1e-9).all()
        later = np.array([9.0, 10.0, 11.5])
        danced = later - dancer.entry - float(np.clip(9.0 - dancer.entry, 0.0, 4.0))
        wanted = plain.dancers[0].at(danced) if danced[0] > 0.0 else plain.dancers[0].at(danced.clip(0.0)[1:])
        np.testing.assert_allclose(dancer.at(later).rotations[-len(wanted) :], wanted.rotations, atol=1e-9)
        own = np.arange(0.1, 8.0, 0.3)
        np.testing.assert_allclose(dancer.own(dancer.clock(own)), own, atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_on_the_ways_of_a_change_nobody_meets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    old, new = places_in("grid", 9, 1.0), rng.permutation(places_in("circle", 9, 1.3)) + rng.uniform(-3, 3, 2)
    taken = assigned(old, new)
    np.testing.assert_allclose(np.sort(taken, axis=0), np.sort(new, axis=0))
    for share in np.linspace(0.0, 1.0, 201):
        on_the_way = (1.0 - share) * old + share * taken
        apart = [float(np.linalg.norm(one - other)) for one, other in combinations(on_the_way, 2)]
        assert min(apart) >= 1.0 / np.sqrt(2.0) - 1e-9


def test_a_plan_has_each_dancer_in_a_colour_of_its_own() -> None:
    motions = canon().motions()
    plate = draw_floor_plan(motions, name="canon", tempo=60.0)
    paths = [mark for mark in plate.marks if isinstance(mark, Line) and mark.title == "path of the pelvis"]
    assert len({path.ink for path in paths}) == 3
    legend = {mark.text for mark in plate.headings if isinstance(mark, Words)}
    assert {"d0", "d1", "d2", "canon: floor plan"} <= legend


def test_a_film_shows_every_dancer_before_one_camera() -> None:
    motions = canon().motions(np.arange(0.0, 12.0, 1.0))
    stage = GroupStage(motions, size=240)
    everybody, floor = stage.picture(3).astype(int), stage.stages[0].empty().astype(int)
    for own in stage.stages:
        assert own.camera is stage.camera
        box = own.drawing(3).box
        assert np.abs(everybody[box] - floor[box]).sum(axis=-1).max() > 150


def test_the_commands_draw_an_ensemble(run: Run) -> None:
    text = 'piece = "ballet/temps-lie"\ntempo = 120\ncanon = 8\nspacing = 1.0\nstage = [2.0, 2.0]\n'
    Path("duo.toml").write_text(text + '[[dancer]]\nname = "Anna"\n[[dancer]]\nname = "Ben"\n', "utf-8")
    ran = run("plan", "duo.toml", "-o", "duo.svg")
    assert ran.code == 0, ran.err
    assert ran.out.startswith("duo.svg: 2 dancers, ")
    assert "near      Anna and Ben: " in ran.out
    assert "leaves the stage" in ran.err
    ran = run("render", "duo.toml", "-o", "duo.gif", "--fps", "2", "--size", "120")
    assert ran.code == 0, ran.err
    with Image.open("duo.gif") as film:
        assert sum(1 for _ in ImageSequence.Iterator(film)) > 20


def test_a_sheet_has_all_dancers_at_counts(run: Run) -> None:
    text = 'piece = "ballet/temps-lie"\ntempo = 60\ncanon = 4\n'
    Path("duo.toml").write_text(text + "[[dancer]]\n[[dancer]]\n", "utf-8")
    seconds = 4.0 + float(np.ptp(PIECE.times))
    for options, pictures in (((), 1 + int(seconds / 2)), (("--every", "5"), 1 + int(seconds / 5))):
        ran = run("sheet", "duo.toml", "-o", "duo.png", *options)
        assert ran.out.startswith(f"duo.png: {pictures} pictures, 2 dancers"), ran.err
    with Image.open("duo.png") as sheet:
        shown = np.array(sheet.convert("RGB")).reshape(-1, 3)
    for number in range(2):
        hue = np.array(dancer_ink(number)) / 255.0
        assert (np.abs(shown / 255.0 - hue).max(axis=1) < 0.05).sum() > 100, "the trunk has the dancer's colour"
    assert run("sheet", "duo.toml", "-o", "duo.pdf", "--postures", "15").out.startswith("duo.pdf: 15 pictures")
    assert Path("duo.pdf").read_bytes().count(b"/Type /Page\n") == 2


def test_convert_writes_one_glb_or_a_bvh_for_each_dancer(run: Run) -> None:
    Path("duo.toml").write_text('piece = "ballet/jump"\n[[dancer]]\nname = "Anna"\n[[dancer]]\n', "utf-8")
    assert run("convert", "duo.toml", "duo.glb").code == 0
    ran = run("convert", "duo.toml", "duo.bvh", "--fps", "30")
    assert ran.code == 0, ran.err
    assert ran.out.startswith("duo-1.bvh, duo-2.bvh: 2 dancers")
    left, right = (read_motion(f"duo-{number}.bvh") for number in (1, 2))
    assert len(left) == len(right)
    np.testing.assert_allclose(left.root[0] - right.root[0], [-1.5, 0.0, 0.0], atol=1e-4)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("convert", "duo.toml", "duo.npz"), ".glb"),
        (("convert", "duo.toml", "duo.glb", "--loop"), "--loop is not for an ensemble"),
        (("render", "duo.toml", "-o", "duo.svg"), ".html"),
        (("render", "duo.toml", "-o", "duo.html", "--size", "240"), "are for films, not for a page"),
        (("sheet", "duo.toml", "-o", "duo.svg"), ".pdf"),
        (("sheet", "duo.toml", "-o", "duo.png", "--columns", "3"), "--columns is not for an ensemble"),
        (("sheet", "duo.toml", "-o", "duo.png", "--postures", "500"), "a sheet holds 400 pictures, not 500"),
        (("render", "duo.toml", "-o", "duo.gif", "--clip", "x"), "--clip is not for an ensemble"),
        (("plan", "duo.toml", "-o", "duo.svg", "--from", "3"), "--from is not for an ensemble"),
        (("plan", "other.toml", "-o", "duo.svg"), "other.toml"),
    ],
)
def test_what_an_ensemble_cannot_be_is_refused(run: Run, arguments: tuple[str, ...], words: str) -> None:
    Path("duo.toml").write_text('piece = "ballet/temps-lie"\n[[dancer]]\n', "utf-8")
    ran = run(*arguments)
    assert (ran.code, ran.out) == (2, "")
    assert words in ran.err
    assert not {"duo.svg", "duo.html", "duo.gif", "duo.png"} & {path.name for path in Path().iterdir()}


@pytest.mark.parametrize(
    ("piece", "arguments"),
    [
        ("duo-2.bvh", ("duo.bvh",)),
        ("trio-1.json", ("trio.toml", "--steps", "ballet")),
        ("sub/own.glb", ("sub/../sub/own.glb",)),
    ],
)
def test_no_piece_is_overwritten(run: Run, piece: str, arguments: tuple[str, ...]) -> None:
    Path("sub").mkdir()
    assert run("convert", "ballet/jump", piece).code == 0
    way = '[[change]]\nat = 2\ncounts = 8\nformation = "circle"\n'
    Path("duo.toml").write_text(f'piece = "{piece}"\ntempo = 120\n[[dancer]]\n[[dancer]]\n{way}', "utf-8")
    before = {path: path.read_bytes() for path in Path().rglob("*.*")}
    ran = run("convert", "duo.toml", *arguments)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.rstrip().endswith(f"{Path(piece).name}: cannot be written: it is read from")
    assert {path: path.read_bytes() for path in Path().rglob("*.*")} == before


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ('piece = "p"\n[[dancer]]\nmirror = true\n', "did you mean mirrored?"),
        ('piece = "p"\nformaton = "V"\n[[dancer]]\n', "did you mean formation?"),
    ],
)
def test_a_misspelt_key_is_met_with_the_right_one(tmp_path: Path, text: str, hint: str) -> None:
    path = tmp_path / "e.toml"
    path.write_text(text)
    with pytest.raises(FormatError) as caught:
        read_ensemble(path, lambda _: PIECE)
    assert str(caught.value).endswith(hint)
