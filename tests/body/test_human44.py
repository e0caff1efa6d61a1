"""human44: its tree and anatomy, its way to files, scores and human23, and tweens on it from end to end."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from click.testing import CliRunner

from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_named, read_body
from motionmind.body.contact import lowest_height
from motionmind.body.human import human23, human44
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.cli import app
from motionmind.corpus import store
from motionmind.discretize.library import Library
from motionmind.discretize.turns import parse_turns
from motionmind.errors import CorpusError, FormatError, NoPathError, SkeletonError
from motionmind.formats import read_motion, read_posture, write_motion, write_posture
from motionmind.formats.papers import read_papers, write_papers
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import compose
from motionmind.retarget.retarget import own_skeleton, to_human23
from motionmind.tween.engine import Engine

Turns = dict[str, str]

BODY, COARSE = human44(), human23()
COMMON = [BODY.index(name) for name in COARSE.names]
SPINE = ("lumbar", "lumbar_middle", "lumbar_upper", "thorax", "thorax_middle", "thorax_upper")
NECK = ("cervical", "cervical_middle", "cervical_upper", "axial", "atlantal")
BALLET = Path(__file__).parents[2] / "corpora" / "ballet"


def at_rest(body: Skeleton) -> tuple[Floats, Floats]:
    """Positions of joints and of tips."""
    both = body.positions_and_tips(np.tile(rot.IDENTITY, (len(body), 1)), np.zeros(3))
    return both[: len(body)], both[len(body) :][np.any(body.tips != 0.0, axis=1)]


# --- movement, written by the angles of joints ------------------------------------------------------------------------

HANGING = {"shoulder": "z -75", "elbow": "y -15"}
LIFTED = {"shoulder": "y -60, z -10", "elbow": "y -60"}
ENDS = {"fingers_end": "z -60", "thumb_end": "y 50"}
MIDDLES = {"fingers_middle": "z -95", "thumb_middle": "y 40"}
KNUCKLES = {"fingers": "z -80", "thumb": "z -35, y 15"}
CURLED = {"ankle": "x 30", "toes": "x 25", "toes_middle": "x 40", "toes_end": "x 30"}


def straight(turns: Turns) -> Turns:
    return dict.fromkeys(turns, "")


def bent(*joints: str) -> Turns:
    return dict.fromkeys(joints, "x 9")


def posed(turns: Turns) -> Floats:
    """Rotations [44, 4]; a joint without its side is both, written for the left."""
    rotations = np.tile(rot.IDENTITY, (len(BODY), 1))
    for joint, text in turns.items():
        if joint in BODY.names:
            rotations[BODY.index(joint)] = parse_turns(text)
        else:
            rotations[BODY.index(f"left_{joint}")] = parse_turns(text)
            rotations[BODY.index(f"right_{joint}")] = rot.mirror(parse_turns(text))
    return rotations


def clip(name: str, *keys: Turns) -> Motion:
    """Keys 0.4 s apart, ten frames a second, on the floor; what a key does not name stays as it was."""
    turns, rows = HANGING, []
    for key in keys:
        turns = turns | key
        rows.append(posed(turns))
    rotations = np.stack(rows)
    root = np.zeros((len(rows), 3))
    root[:, 1] = -lowest_height(BODY, rotations, root)
    return Motion(BODY, rotations, root, 0.4 * np.arange(len(rows)), name).resample(10.0)


@cache
def dances() -> list[Motion]:
    """Hands that close row by row while the arms lift, toes that curl, a spine that rolls down; all there and back."""
    down = [bent(*NECK), bent(*SPINE[3:]), bent(*SPINE[:3])]
    up = [straight(part) for part in reversed(down)]
    closed = [LIFTED | ENDS, MIDDLES, KNUCKLES]
    return [
        clip("fist", {}, *closed, straight(KNUCKLES), straight(MIDDLES), straight(ENDS) | HANGING, {}),
        clip("toes", {}, CURLED, {}, straight(CURLED), {}),
        clip("roll", {}, *down, {}, *up, {}),
    ]


def fist() -> Posture:
    return dances()[0].posture(12)


def rolled() -> Posture:
    return dances()[2].posture(12)


# --- the tree ---------------------------------------------------------------------------------------------------------


def test_human44_is_human23_with_hands_toes_and_a_spine() -> None:
    hangs = {name: BODY.names[parent] if parent >= 0 else None for name, parent in zip(BODY.names, BODY.parents)}  # noqa: B905
    expected: dict[str, str | None] = {"pelvis": None}
    expected |= dict(zip((*SPINE, *NECK), ("pelvis", *SPINE, *NECK), strict=False))
    for s in ("left", "right"):
        arm = ("thorax_upper", *(f"{s}_{joint}" for joint in ("clavicle", "shoulder", "elbow", "wrist")))
        leg = ("pelvis", *(f"{s}_{joint}" for joint in ("hip", "knee", "ankle")))
        toes = [f"{s}_toes{row}" for row in ("", "_middle", "_end")]
        fingers, thumb = ([f"{s}_{digit}{row}" for row in ("", "_middle", "_end")] for digit in ("fingers", "thumb"))
        for chain in ((*arm, *fingers), (arm[-1], *thumb), (*leg, *toes)):
            expected |= dict(zip(chain[1:], chain, strict=False))
    assert hangs == expected
    assert len(BODY) == 44
    assert set(COARSE.names) < set(BODY.names)


def test_joints_that_human23_has_stand_where_they_stand_there_and_ends_too() -> None:
    (joints, tips), (coarse_joints, coarse_tips) = at_rest(BODY), at_rest(COARSE)
    np.testing.assert_allclose(joints[COMMON], coarse_joints, atol=1e-15)
    thumbs = {BODY.index(f"{side}_thumb_end") for side in ("left", "right")}
    leaves = [joint for joint in range(44) if not BODY.children(joint)]
    np.testing.assert_array_equal(np.flatnonzero(np.any(BODY.tips != 0.0, axis=1)), leaves)
    shared = [tip for joint, tip in zip(leaves, tips, strict=True) if joint not in thumbs]
    np.testing.assert_allclose(shared, coarse_tips, atol=1e-15)
    assert BODY.height == COARSE.height


def test_human44_is_symmetric() -> None:
    flip = np.array([-1.0, 1.0, 1.0])
    for joint, name in enumerate(BODY.names):
        side, _, rest = name.partition("_")
        if side != "right":
            other = BODY.index(f"right_{rest}") if side == "left" else joint
            np.testing.assert_array_equal(BODY.offsets[other], flip * BODY.offsets[joint])
            np.testing.assert_array_equal(BODY.tips[other], flip * BODY.tips[joint])


def test_a_fist_is_in_the_hand() -> None:
    both = BODY.positions_and_tips(fist().rotations, np.zeros(3))
    turned = BODY.global_rotations(fist().rotations)
    wrist = BODY.index("left_wrist")

    def in_the_hand(at: int) -> Floats:
        """Seen from the wrist: along the hand, up from the back of it, towards the thumb; metres."""
        return rot.mul_vec(rot.inv(turned[wrist]), both[at] - both[wrist])

    fingertips, thumb = in_the_hand(44 + BODY.index("left_fingers_end")), in_the_hand(44 + BODY.index("left_thumb_end"))
    assert 0.04 < fingertips[0] < 0.09  # back over the palm
    assert -0.05 < fingertips[1] < -0.01  # under it
    assert thumb[1] < fingertips[1] - 0.01  # the thumb lies over them
    assert thumb[2] < 0.02  # and across


# --- files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".json", ".bvh"])
def test_movement_comes_back_from_files_on_all_its_joints(tmp_path: Path, suffix: str) -> None:
    for motion in dances():
        path = tmp_path / f"{motion.name}{suffix}"
        write_motion(path, motion)
        back = own_skeleton(read_motion(path))
        assert BODY.difference(back.skeleton) is None
        np.testing.assert_allclose(back.skeleton.offsets, BODY.offsets, atol=1e-7)
        assert rot.angle(back.rotations, motion.rotations).max() < 1e-6
        np.testing.assert_allclose(back.root, motion.root, atol=1e-6)
        np.testing.assert_allclose(back.times, motion.times, atol=1e-6)


def test_json_names_it_and_describes_other_proportions(tmp_path: Path) -> None:
    motion = dances()[0]
    write_motion(tmp_path / "a.json", motion)
    assert json.loads((tmp_path / "a.json").read_text())["skeleton"] == "human44"
    assert read_motion(tmp_path / "a.json").skeleton is BODY
    taller = Skeleton("human44", BODY.names, BODY.parents, 1.1 * BODY.offsets, 1.1 * BODY.tips)
    write_posture(tmp_path / "b.json", replace(motion, skeleton=taller).posture(3))
    assert len(json.loads((tmp_path / "b.json").read_text())["skeleton"]["joints"]) == 44
    assert read_posture(tmp_path / "b.json").skeleton == taller


@pytest.mark.parametrize("form", ["braces", "lines"])
def test_the_papers_notation_is_known_by_its_joints(tmp_path: Path, form: Literal["braces", "lines"]) -> None:
    path = tmp_path / "fist.txt"
    write_papers(path, dances()[0], form=form)
    assert ("left thumb middle," in path.read_text()) == (form == "braces")
    for back in (read_papers(path), read_papers(path, skeleton=BODY), read_motion(path)):
        assert back.skeleton is BODY
        assert rot.angle(back.rotations, dances()[0].rotations).max() < 1e-9
    write_papers(path, to_human23(dances()[0]), form=form)
    assert read_papers(path).skeleton is COARSE


@pytest.mark.filterwarnings("ignore:.*stand at rest")
def test_a_slip_in_the_papers_notation_is_answered_on_the_body_that_is_meant(tmp_path: Path) -> None:
    path = tmp_path / "slip.txt"
    path.write_text("{pelvis, 0, 0, 0, 1; left thumb, 0, 0, 0, 1; left thum end, 0, 0, 0, 1}")
    with pytest.raises(FormatError, match=r"human44 has no joint 'left thum end'; did you mean left_thumb_end\?"):
        read_papers(path)
    path.write_text("{pelvis, 0, 0, 0, 1; left thum, 0, 0, 0, 1}")
    with pytest.raises(FormatError, match="human23 has no joint 'left thum'"):
        read_papers(path)


def test_libraries_of_states_know_its_joints() -> None:
    rows = {"open": "", "hooked": "z -90"}
    library = Library({"fingers_middle": rows, "axial": {"ahead": ""}}, skeleton="human44")
    tables = library.tables_of(BODY.names)
    assert {BODY.names[joint] for joint in tables} == {"left_fingers_middle", "right_fingers_middle", "axial"}
    with pytest.raises(FormatError, match=r"\[finger_middle\]: no such joint; did you mean fingers_middle\?"):
        Library({"finger_middle": rows}, skeleton="human44")
    with pytest.raises(FormatError, match=r"\[axial\]: no such joint"):
        Library({"axial": rows})


# --- from and to human23 ----------------------------------------------------------------------------------------------


def test_what_came_from_human23_goes_back_as_it_was() -> None:
    for path in sorted((BALLET / "clips").glob("*.json")):
        there = read_motion(path)
        rotations = np.tile(rot.IDENTITY, (len(there), 44, 1))
        rotations[:, COMMON] = there.rotations
        fine = Motion(BODY, rotations, there.root, there.times, there.name)
        places = BODY.positions(rotations, there.root)[:, COMMON]
        np.testing.assert_allclose(places, COARSE.positions(there.rotations, there.root), atol=1e-12)
        back = to_human23(fine)
        assert back.skeleton is COARSE
        assert back.name == there.name
        assert rot.angle(back.rotations, there.rotations).max() < 1e-12
        np.testing.assert_array_equal(back.root, there.root)
        np.testing.assert_array_equal(back.times, there.times)


def test_on_human23_all_that_is_common_faces_as_it_did() -> None:
    ends = {"lumbar": "lumbar_upper", "thorax": "thorax_upper", "cervical": "cervical_upper"}
    for motion in dances():
        coarse = to_human23(motion)
        seen = COARSE.global_rotations(coarse.rotations)
        expected = BODY.global_rotations(motion.rotations)
        expected = expected[:, [BODY.index(ends.get(name, name)) for name in COARSE.names]]
        assert rot.angle(seen, expected).max() < 1e-12
    legs = list(range(COARSE.index("lumbar") + 1))
    places = BODY.positions(motion.rotations, motion.root)[:, [COMMON[joint] for joint in legs]]
    np.testing.assert_allclose(COARSE.positions(coarse.rotations, coarse.root)[:, legs], places, atol=1e-12)


def test_it_is_never_brought_to_human23_unasked(tmp_path: Path) -> None:
    motion = dances()[0]
    assert own_skeleton(motion) is motion
    assert own_skeleton(fist()).skeleton is BODY
    short = Skeleton("a child", BODY.names, BODY.parents, 0.7 * BODY.offsets, 0.7 * BODY.tips)
    assert own_skeleton(replace(motion, skeleton=short)).skeleton is short
    cased = Skeleton("a program's", tuple(n.title().replace("_", "") for n in BODY.names), BODY.parents, BODY.offsets)
    assert own_skeleton(replace(motion, skeleton=cased)).skeleton is cased
    assert to_human23(replace(motion, skeleton=cased)).skeleton.names == COARSE.names
    asked = own_skeleton(motion, {name: name for name in COARSE.names})
    assert COARSE.difference(asked.skeleton) is None


def test_a_corpus_is_on_one_of_the_two() -> None:
    with pytest.raises(CorpusError, match="coarse is on another skeleton than fist: human23 lacks left_toes_middle"):
        Engine.fit([dances()[0], replace(to_human23(dances()[1]), name="coarse")])
    coarse = Engine.fit([to_human23(motion) for motion in dances()], rate=5)
    tween = coarse.tween(fist(), rolled(), fps=10.0)
    assert tween.motion.skeleton.name == "human23"
    fine = Engine.fit(dances(), name="hands", rate=5)
    with pytest.raises(SkeletonError, match="posture B is on another skeleton than corpus 'hands': human23 lacks"):
        fine.tween(fist(), to_human23(rolled()))


# --- scores -----------------------------------------------------------------------------------------------------------

SCORE = """
body {body}
legs
  on   = stand out 3 turn 20
  knee = hip flexion 70, knee flexion 90
arms
  side = shoulder abduction 70, elbow flexion 30
torso
  low  = lumbar flexion 30, thorax flexion 20 turn 15
  s    = spine bend 20
head
  up   = head extension 20, cervical turn 10
  down = head flexion 25 turn 40
clip a
  start | on        |
  1     | on        | side | low left | up left
  1     | on / knee |      | s right  | down left
"""


def composed(folder: Path, text: str) -> Motion:
    path = folder / "a.score"
    path.write_text(text)
    return compose(path)


def test_words_of_human23_mean_the_same(tmp_path: Path) -> None:
    coarse, fine = (composed(tmp_path, SCORE.format(body=name)) for name in ("human23", "human44"))
    assert (coarse.skeleton, fine.skeleton) == (COARSE, BODY)
    back = to_human23(fine)
    seen = [COARSE.global_rotations(motion.rotations) for motion in (coarse, back)]
    assert np.degrees(rot.angle(*seen)).max() < 3.5  # angles about several axes add up nearly
    np.testing.assert_allclose(BODY.positions_and_tips(fine.rotations, fine.root)[..., 1].min(axis=1), 0.0, atol=1e-4)
    assert np.abs(back.root - coarse.root).max() < 0.02


def test_rows_share_out_all_that_human23_can_do() -> None:
    fine, coarse = anatomy_named("human44"), anatomy_named("human23")
    for group, joints in fine.groups.items():
        for angle in ("flexion", "bend", "turn"):
            assert sum(shares[angle] for shares in joints.values()) == pytest.approx(1.0), group
    for group in ("lumbar", "thorax", "cervical", "atlantal"):
        for name, angle in coarse.joints[group].angles.items():
            for joint, shares in fine.groups[group].items():
                own = fine.joints[joint].angles[name]
                assert own.about == angle.about
                for limit, needed in zip(own.range, angle.range, strict=True):
                    assert abs(limit) >= abs(needed * shares[name]) - 0.5, f"{joint} {name}"
    masses = [sum(joint.mass for joint in each.joints.values()) for each in (fine, coarse)]
    assert masses[0] == pytest.approx(masses[1])
    poses = [np.tile(rot.IDENTITY, (len(each.skeleton), 1)) for each in (fine, coarse)]
    middles = [each.centre_of_mass(pose, np.zeros(3)) for each, pose in zip((fine, coarse), poses, strict=True)]
    np.testing.assert_allclose(*middles, atol=1e-4)


def test_a_joint_that_gives_its_name_to_a_row_can_bend_alone(tmp_path: Path) -> None:
    text = "body human44\ntorso\n  a = sacrum flexion 20\n  b = lumbar flexion 40\nclip c\n  start |||a\n  1 |||b"
    degrees = anatomy_named("human44").degrees(composed(tmp_path, text).rotations)[..., 0]
    rows = [BODY.index(name) for name in SPINE[:3]]
    np.testing.assert_allclose(degrees[0, rows], [20.0, 0.0, 0.0], atol=1e-4)
    np.testing.assert_allclose(degrees[1, rows], [18.0, 15.6, 6.4], atol=1e-4)


def test_toes_that_touch_are_on_the_floor_however_they_curl(tmp_path: Path) -> None:
    text = """body human44
legs
  on = stand turn 30
  a = touch towards 0, ankle plantar 60 / on
  b = touch towards 0, ankle plantar 30, toes flexion 20, toes_middle flexion 30, toes_end flexion 40 / on
clip a
  start | a left
  1 | b left
"""
    motion = composed(tmp_path, text)
    places = BODY.positions_and_tips(motion.rotations, motion.root)[..., 1]
    left = [BODY.index("left_toes"), BODY.index("left_toes_middle"), BODY.index("left_toes_end")]
    np.testing.assert_allclose(places[:, [*left, 44 + left[-1]]].min(axis=1), 0.0, atol=1e-4)
    assert places.min() > -1e-4


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('extends = "human32"', "no body 'human32'; did you mean human23?"),
        ("extends = 3", "no body 3; there are human23, human44"),
        ('extends = "human23"\njoints = 3', "cannot be read as a body"),
        ('extends = "human23"\ngroups.spine.lumber = 0.5', "[groups] spine: no joint 'lumber'; did you mean lumbar?"),
        (
            'extends = "human23"\ngroups.a.lumbar.flexion = 1.0',
            "[groups] a: lumbar needs a share of flexion, bend",
        ),
    ],
)
def test_faults_of_a_body_that_extends_another(tmp_path: Path, line: str, message: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f'format = "motionmind-body"\nversion = 1\nname = "human23"\n{line}\n')
    with pytest.raises(FormatError) as caught:
        read_body(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)


def test_a_body_that_extends_another_says_only_what_differs(tmp_path: Path) -> None:
    path = tmp_path / "stiff.toml"
    text = 'extends = "human23"\nformat = "motionmind-body"\nversion = 1\nname = "human23"\n'
    path.write_text(text + "joints.knee.flexion.range = [0, 90]\n")
    stiff, coarse = read_body(path), anatomy_named("human23")
    assert stiff.joints["knee"].angles["flexion"].range == (0.0, 90.0)
    assert stiff.joints["knee"].mass == coarse.joints["knee"].mass
    assert {name for name, joint in stiff.joints.items() if joint != coarse.joints[name]} == {"knee"}
    assert (stiff.layers, stiff.groups, stiff.leg) == (coarse.layers, coarse.groups, coarse.leg)


# --- tweens -----------------------------------------------------------------------------------------------------------


@cache
def engine() -> Engine:
    return Engine.fit(dances(), name="hands", rate=5)


@pytest.mark.parametrize("strict", [True, False], ids=["strict", "bridged"])
def test_a_tween_from_a_fist_to_a_spine_that_has_rolled_down(strict: bool) -> None:
    tween = engine().tween(fist(), rolled(), strict=strict)
    assert tween.status == "optimal"
    assert tween.cost == pytest.approx(tween.lower_bound, abs=1e-6)
    assert tween.motion.skeleton is BODY
    assert tween.path.shape[1] == 45  # the joints, and the facing
    for end, posture in ((0, fist()), (-1, rolled())):
        assert rot.angle(tween.motion.rotations[end], posture.rotations).max() < 1e-9
        np.testing.assert_allclose(tween.motion.root[end], posture.root, atol=1e-9)
    assert not (strict and tween.bridges)
    assert tween.attested > 0.9


def test_a_hand_that_was_only_seen_to_close_opens_by_bridges_alone() -> None:
    closing = [replace(dances()[0].slice(0, 13), name="closing"), dances()[1]]
    only = Engine.fit(closing, rate=5)
    start = dances()[0].posture(0)
    with pytest.raises(NoPathError, match="fingers"):
        only.tween(fist(), start, strict=True)
    tween = only.tween(fist(), start)
    assert tween.status == "optimal"
    bridged = {bridge.joint for bridge in tween.bridges}
    assert {"left_fingers_middle", "right_thumb"} <= bridged
    assert not bridged & {"left_hip", "axial", "left_toes_end"}


def test_a_tween_over_the_bundled_hands() -> None:
    hands = Engine.load("hands")
    assert hands.corpus.skeleton is not COARSE
    assert BODY.difference(hands.corpus.skeleton) is None
    assert {clip.name for clip in hands.corpus.clips} == {"rows", "wave", "roll"}
    starts = {clip.name: clip.start for clip in hands.corpus.clips}

    def taken(clip: str, frame: int) -> Posture:
        at = starts[clip] + frame
        return Posture(hands.corpus.skeleton, hands.corpus.rotations[at], hands.corpus.root[at])

    closed, over, curled = taken("rows", 5), taken("roll", 10), taken("roll", 26)
    for a, b in ((closed, over), (over, closed), (closed, curled), (curled, over)):
        tween = hands.tween(a, b, strict=True)
        assert tween.status == "optimal"
        assert tween.attested == 1.0


# --- as a user does it ------------------------------------------------------------------------------------------------


def test_from_files_to_a_tween_on_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MOTIONMIND_HOME", str(tmp_path / "home"))
    for motion, suffix in zip(dances(), ("json", "bvh", "json"), strict=True):
        write_motion(f"{motion.name}.{suffix}", motion)

    def run(command: str) -> str:
        result = CliRunner().invoke(app, command.split(), catch_exceptions=False, standalone_mode=False)
        return result.output

    assert "built" in run("corpus build mine fist.json toes.bvh roll.json --rate 5")
    info: Any = json.loads(run("corpus info mine --json"))
    assert (info["skeleton"], len(info["joints"])) == ("human44", 44)
    assert "on human44 (44 joints)" in run("posture fist.json --frame 12 -o A.json")
    assert "44 joints" in run("posture toes.bvh --frame 6 -o B.bvh")
    assert "Path proven optimal, " in run("tween A.json B.bvh --corpus mine -o tween.json --strict")
    assert BODY.difference(read_motion("tween.json").skeleton) is None
    assert "44 joints" in run("convert tween.json tween.txt")
    assert read_motion("tween.txt").skeleton is BODY
    assert "23 joints (human23)" in run("convert tween.json coarse.json --skeleton human23")
    assert read_motion("coarse.json").skeleton is COARSE
    assert store.list_corpora(None)["mine"].is_relative_to(tmp_path / "home")
