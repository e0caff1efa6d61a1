"""Laws of the four discretizations: what holds for any movement, checked on random and on real movement."""

import contextlib
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind.body.human import human23
from motionmind.bundled import bundled
from motionmind.discretize import states as states_module
from motionmind.discretize.codebook import Codebook
from motionmind.discretize.expert import ExpertLibrary
from motionmind.discretize.grids import EulerGrid, QuaternionGrid
from motionmind.discretize.library import Library, format_library, parse_library, read_library, write_library
from motionmind.discretize.protocol import Discretization
from motionmind.discretize.spec import from_spec, make_discretization, to_spec
from motionmind.discretize.states import StateSpace
from motionmind.discretize.turns import format_turns, parse_turns
from motionmind.errors import CorpusError, FormatError, MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot

SHARED = Path(__file__).parents[2].parent / "shared" / "data"
NAMES = ("pelvis", "left_hip", "right_hip", "left_knee")
# How far rounding in the sixteenth digit may carry an angle, in degrees.
SLACK = 1e-5

SMALL = """
format = "motionmind-library"
version = 1
title = "Two joints"
skeleton = "human23"

[hip]
"rest" = ""
"devant 90" = "x -90"
"devant 90 turned out" = "x -90, y 45"

[pelvis]
"front" = [0, 0, 0, 2]
"left" = "y 90"
"""


def random_rotations(count: int, joints: int, seed: int = 0) -> np.ndarray:
    """Orientations [count, joints, 4]: anywhere, near the identity, near half turns, and some of them twice."""
    rng = np.random.default_rng(seed)
    q = rot.normalise(rng.normal(size=(count, joints, 4)))
    third = count // 3
    q[:third] = rot.exp(0.05 * rng.normal(size=(third, joints, 3)))
    axis = rot.normalise(rng.normal(size=(third, joints, 4)))[..., :3]
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    q[third : 2 * third] = rot.from_axis_angle(axis, np.pi + 1e-4 * rng.normal(size=(third, joints)))
    q[-5:] = q[:5]
    return q


def kinds(tolerance: float = 25.0) -> list[Discretization]:
    return [
        Codebook(tolerance),
        QuaternionGrid(QuaternionGrid.step_for(tolerance)),
        EulerGrid(EulerGrid.degrees_for(tolerance)),
        EulerGrid(90.0, "XYZ"),
        ExpertLibrary(parse_library(SMALL), tolerance),
    ]


def label_of(kind: Discretization) -> str:
    return f"{kind.kind}-{getattr(kind, 'order', '')}"


every_kind = pytest.mark.parametrize("kind", kinds(), ids=label_of)


@every_kind
class TestEveryKind:
    def test_decoding_then_assigning_gives_the_state_back(self, kind: Discretization) -> None:
        space = kind.fit(NAMES, random_rotations(300, 4))
        for j, size in enumerate(space.sizes):
            states = np.zeros((size, 4), dtype=np.int32)
            states[:, j] = np.arange(size)
            assert np.array_equal(space.assign(space.decode(states)), states)

    def test_a_quaternion_and_its_negative_are_one(self, kind: Discretization) -> None:
        q = random_rotations(200, 4)
        signs = np.where(np.random.default_rng(1).random((200, 4, 1)) < 0.5, -1.0, 1.0)
        space, turned = kind.fit(NAMES, q), kind.fit(NAMES, q * signs)
        assert np.array_equal(space.centres, turned.centres)
        assert np.array_equal(space.assign(q), space.assign(-q))

    def test_the_order_of_postures_does_not_matter(self, kind: Discretization) -> None:
        q = random_rotations(200, 4)
        shuffled = q[np.random.default_rng(2).permutation(200)]
        assert np.array_equal(kind.fit(NAMES, q).centres, kind.fit(NAMES, shuffled).centres)

    def test_the_order_of_joints_does_not_matter(self, kind: Discretization) -> None:
        q = random_rotations(200, 4)
        order = [2, 0, 3, 1]
        space = kind.fit(NAMES, q)
        other = kind.fit([NAMES[j] for j in order], q[:, order])
        for name in NAMES:
            assert np.array_equal(space.of(name), other.of(name))
        assert np.array_equal(space.assign(q)[:, order], other.assign(q[:, order]))

    def test_the_state_is_the_nearest_one(self, kind: Discretization) -> None:
        q = random_rotations(60, 4)
        space = kind.fit(NAMES, q)
        other = random_rotations(80, 4, seed=3)
        states = space.assign(other)
        distance = space.distance(other, states)
        for j in range(4):
            brute = np.degrees(rot.angle(other[:, j, None], space.of(j)[None]))
            assert np.allclose(distance[:, j], brute[np.arange(80), states[:, j]])
            assert np.all(distance[:, j] <= brute.min(axis=1) + 1e-3)

    def test_centres_are_canonical_unit_quaternions_and_distinct(self, kind: Discretization) -> None:
        space = kind.fit(NAMES, random_rotations(200, 4))
        assert np.allclose(np.linalg.norm(space.centres, axis=1), 1.0)
        assert np.array_equal(space.centres, rot.canonical(space.centres))
        for j in range(4):
            apart = rot.angle(space.of(j)[:, None], space.of(j)[None]) + np.eye(space.sizes[j])
            assert apart.min() > 1e-6

    def test_one_posture_is_enough_and_none_is_not(self, kind: Discretization) -> None:
        q = random_rotations(9, 4)[:1]
        space = kind.fit(NAMES, q)
        assert space.assign(q).shape == (1, 4)
        with pytest.raises(MotionMindError, match="no postures"):
            kind.fit(NAMES, q[:0])

    def test_a_manifest_rebuilds_it(self, kind: Discretization) -> None:
        q = random_rotations(100, 4)
        again = from_spec(json.dumps(to_spec(kind)))
        assert again == kind
        assert np.array_equal(again.fit(NAMES, q).centres, kind.fit(NAMES, q).centres)

    @pytest.mark.parametrize(
        "q",
        [np.zeros((3, 4, 4)), np.full((3, 4, 4), np.nan), np.zeros((3, 5, 4)), np.zeros(4)],
        ids=["zero", "nan", "joints", "shape"],
    )
    def test_invalid_rotations_are_rejected(self, kind: Discretization, q: np.ndarray) -> None:
        with pytest.raises(MotionMindError):
            kind.fit(NAMES, q)
        with pytest.raises(MotionMindError):
            kind.fit(NAMES, random_rotations(20, 4)).assign(q)


@pytest.mark.parametrize("tolerance", [0.01, 3.0, 20.0, 75.0, 180.0])
@pytest.mark.parametrize("kind", ["codebook", "quaternion", "euler"])
def test_every_sample_lies_within_the_tolerance(kind: str, tolerance: float) -> None:
    q = random_rotations(400, 4)
    space = make_discretization(kind, tolerance).fit(NAMES, q)
    # The grids stop widening at some point, which keeps the promise all the more.
    assert np.allclose(space.tolerances, tolerance if kind == "codebook" or tolerance < 120.0 else space.tolerances[0])
    assert space.tolerances.max() <= tolerance + SLACK
    states = space.assign(q)
    assert space.distance(q, states).max() <= tolerance + SLACK
    # Learned kinds have no state that nothing visits.
    assert [len(np.unique(column)) for column in states.T] == list(space.sizes)


def test_the_bound_on_euler_cells_holds_where_it_is_tight() -> None:
    # At gimbal lock the first and the last axis meet: the worst case of the derivation.
    h = np.radians(7.5)
    angles = np.stack(np.meshgrid([-h, h], [np.pi / 2 - h, np.pi / 2 + h], [-h, h]), axis=-1).reshape(-1, 3)
    cell = rot.from_euler("ZXY", np.array([0.0, np.pi / 2, 0.0]))
    worst = np.degrees(rot.angle(rot.from_euler("ZXY", angles), cell)).max()
    assert worst <= 15.0 * np.sqrt(5.0) / 2.0
    assert worst > 15.0 * np.sqrt(5.0) / 2.0 - 0.2


def test_a_quaternion_grid_has_only_cells_that_occur() -> None:
    q = random_rotations(300, 4)
    step = 0.2
    space = QuaternionGrid(step).fit(NAMES, q)
    for j in range(4):
        cells = rot.normalise(np.rint(rot.canonical(q[:, j]) / step))
        assert np.abs(cells @ space.of(j).T).max(axis=0).min() > 1.0 - 1e-12


def test_an_euler_grid_has_only_cells_that_occur() -> None:
    q = random_rotations(300, 4)
    space = EulerGrid(20.0, "YZX").fit(NAMES, q)
    for j in range(4):
        angles = rot.to_euler("YZX", rot.canonical(q[:, j]))
        cells = rot.from_euler("YZX", np.radians(20.0 * np.rint(np.degrees(angles) / 20.0)))
        assert np.abs(cells @ space.of(j).T).max(axis=0).min() > 1.0 - 1e-12


def test_a_finer_codebook_never_has_fewer_states() -> None:
    q = random_rotations(400, 4)
    sizes = [Codebook(tolerance).fit(NAMES, q).sizes for tolerance in (60.0, 30.0, 15.0, 7.0)]
    assert np.all(np.diff(sizes, axis=0) >= 0)


def test_a_crowd_does_not_merge_states() -> None:
    # Two crowds on both sides of a border, and each centre's own sample far behind: means would all but meet.
    about = rot.from_axis_angle([0.0, 0.0, 1.0], np.radians([0.0, 20.0] + [9.99999, 10.00001] * 500))
    space = Codebook(15.0).fit(["a"], about[:, None])
    assert space.distance(about[:, None], space.assign(about[:, None])).max() <= 15.0 + SLACK
    states = np.arange(space.sizes[0], dtype=np.int32)[:, None]
    assert np.array_equal(space.assign(space.decode(states)), states)


def test_ties_go_to_the_lowest_index() -> None:
    turn = [rot.about_vertical(np.radians(angle)) for angle in (-30.0, 30.0, 90.0)]
    space = StateSpace.of_joints(["a"], [np.stack(turn)], kind="test", tolerances=np.array([30.0]))
    between = rot.about_vertical(np.radians([[0.0], [60.0]]))
    assert space.assign(between).tolist() == [[0], [1]]
    assert space.assign(-between).tolist() == [[0], [1]]


@pytest.mark.parametrize("further", [-1e-12, 0.0, 1e-12])
def test_ties_but_for_rounding_go_to_the_lowest_index_too(further: float) -> None:
    centres = rot.about_vertical(np.array([-0.5, 0.5 + further]))
    assert states_module.nearest(rot.about_vertical(np.zeros((1,))), centres)[0].tolist() == [0]


def test_a_state_is_in_the_middle_of_its_samples_on_both_sides_of_half_a_turn_too() -> None:
    about = rot.canonical(rot.about_vertical(np.radians([172.0, 174.0, 176.0, 182.0, 188.0])))
    (centre,) = Codebook(15.0).fit(["a"], about[:, None]).of("a")
    assert np.degrees(rot.angle(centre, rot.about_vertical(np.radians(178.4)))) < 0.1


def test_small_blocks_give_the_same_as_one() -> None:
    q = random_rotations(500, 1)[:, 0]
    centres = Codebook(10.0).fit(["a"], q[:, None]).of("a")
    whole = states_module.nearest(q, centres, block=1 << 30)
    for block in (1, 7 * len(centres), 1 << 14):
        part = states_module.nearest(q, centres, block=block)
        assert np.array_equal(whole[0], part[0])
        assert np.allclose(whole[1], part[1], rtol=0.0, atol=1e-15)


@pytest.mark.long
def test_the_same_bytes_whatever_the_hash_seed() -> None:
    script = (
        "import hashlib, sys, numpy as np\n"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from test_discretize import NAMES, kinds, random_rotations\n"
        "q = random_rotations(300, 4)\n"
        "for kind in kinds():\n"
        "    space = kind.fit(NAMES, q)\n"
        "    print(hashlib.sha256(space.centres.tobytes() + space.assign(q).tobytes()).hexdigest(), space.labels)\n"
    )
    outputs = []
    for seed in ("0", "1"):
        run = subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        outputs.append(run.stdout)
    assert outputs[0] == outputs[1]
    first = kinds()[0].fit(NAMES, random_rotations(300, 4))
    digest = hashlib.sha256(first.centres.tobytes() + first.assign(random_rotations(300, 4)).tobytes()).hexdigest()
    assert outputs[0].startswith(digest)


def test_states_are_saved_and_mapped(tmp_path: Path) -> None:
    q = random_rotations(100, 4)
    space = Codebook(20.0).fit(NAMES, q)
    np.save(tmp_path / "centres.npy", space.centres)
    mapped = np.load(tmp_path / "centres.npy", mmap_mode="r")
    again = StateSpace(space.names, mapped, space.starts, space.kind, space.tolerances)
    assert np.shares_memory(again.centres, mapped)
    assert np.array_equal(again.assign(q), space.assign(q))


class TestStateSpace:
    space = ExpertLibrary(parse_library(SMALL)).fit(NAMES, random_rotations(50, 4))

    def test_labels(self) -> None:
        assert self.space.label("left_hip", 1) == "devant 90"
        assert self.space.label(0, 0) == "front"
        assert self.space.label("left_knee", 0) == "state 0"
        with pytest.raises(MotionMindError, match="states 0 to 2, no state 3"):
            self.space.label("left_hip", 3)
        with pytest.raises(SkeletonError, match="no joint 'hip'"):
            self.space.label("hip", 0)

    @pytest.mark.parametrize("states", [[[0, 3, 0, 0]], [[0, -1, 0, 0]], [[0.5, 0, 0, 0]], [0, 0, 0, 0], [[0]]])
    def test_unknown_states_are_rejected(self, states: list[object]) -> None:
        with pytest.raises(MotionMindError):
            self.space.decode(np.array(states))

    def test_lengths_must_agree(self) -> None:
        with pytest.raises(MotionMindError, match="3 postures"):
            self.space.distance(random_rotations(9, 4)[:3], np.zeros((2, 4), dtype=np.int32))

    @pytest.mark.parametrize(
        "change",
        [
            {"names": ("a", "a")},
            {"names": ()},
            {"starts": np.array([0, 0, 2])},
            {"starts": np.array([0, 1])},
            {"centres": np.zeros((2, 4))},
            {"centres": np.full((2, 4), np.nan)},
            {"centres": np.ones((3, 4)) / 2},
            {"tolerances": np.array([1.0, 0.0])},
            {"tolerances": np.array([1.0])},
            {"labels": (("one", "two"), ())},
            {"labels": ((),)},
        ],
        ids=str,
    )
    def test_mismatched_arguments_are_rejected(self, change: dict[str, object]) -> None:
        good = {
            "names": ("a", "b"),
            "centres": np.ones((2, 4)) / 2,
            "starts": np.array([0, 1, 2]),
            "kind": "test",
            "tolerances": np.ones(2),
        }
        StateSpace(**good)  # type: ignore[arg-type]
        with pytest.raises(MotionMindError):
            StateSpace(**{**good, **change})  # type: ignore[arg-type]


class TestMake:
    def test_per_joint_tolerances(self) -> None:
        q = random_rotations(200, 4)
        for kind in ("codebook", "quaternion", "euler"):
            space = make_discretization(kind, 30.0, {"left_hip": 10.0, "hip": 20.0}).fit(NAMES, q)
            assert np.allclose(space.tolerances, [30.0, 10.0, 20.0, 30.0])
            assert np.all(space.distance(q, space.assign(q)).max(axis=0) <= space.tolerances + SLACK)

    @pytest.mark.parametrize("kind", ["codebook", "quaternion", "euler", "human23"])
    def test_an_unknown_joint_is_named_with_the_one_meant(self, kind: str) -> None:
        with pytest.raises(SkeletonError, match=r"'left_hpi'.*did you mean left_hip"):
            make_discretization(kind, 15.0, {"left_hpi": 10.0}).fit(human23().names, random_rotations(9, 23))

    @pytest.mark.parametrize("kind", ["codebook", "quaternion", "euler", "human23"])
    @pytest.mark.parametrize("tolerance", [0.0, -1.0, 181.0, float("nan"), float("inf"), "15", True, None])
    def test_invalid_tolerances_are_rejected_in_degrees(self, kind: str, tolerance: object) -> None:
        with pytest.raises(MotionMindError, match="degrees"):
            make_discretization(kind, tolerance)  # type: ignore[arg-type]
        with pytest.raises(MotionMindError, match="left_hip"):
            make_discretization(kind, 15.0, {"left_hip": tolerance})  # type: ignore[dict-item]

    def test_an_unknown_kind_names_the_known_ones(self) -> None:
        with pytest.raises(FormatError, match=r"human23.*did you mean codebook"):
            make_discretization("codebok")
        with pytest.raises(FormatError, match=r"nowhere\.toml"):
            make_discretization("nowhere.toml")

    def test_a_library_by_name_and_by_file(self, tmp_path: Path) -> None:
        (tmp_path / "small.toml").write_text(SMALL)
        assert make_discretization(str(tmp_path / "small.toml"), 20.0) == ExpertLibrary(parse_library(SMALL), 20.0)
        assert make_discretization("human23", 20.0) == from_spec(
            {"kind": "library", "library": "human23", "tolerance": 20.0}
        )

    @pytest.mark.parametrize(
        "spec",
        [
            "{",
            "[" * 100_000,
            "[]",
            "{}",
            {"kind": 3},
            {"kind": ["codebook"]},
            {"kind": "codebok"},
            {"kind": "codebook", "tolerence": 3},
            {"kind": "codebook", "tolerance": "wide"},
            {"kind": "codebook", "tolerance": float("nan")},
            {"kind": "codebook", "per_joint": [1]},
            {"kind": "codebook", "per_joint": {"left_hip": None}},
            {"kind": "quaternion", "step": 0},
            {"kind": "euler", "order": "ZZX"},
            {"kind": "euler", "order": None},
            {"kind": "library"},
            {"kind": "library", "library": {}},
            {"kind": "library", "library": "no such library"},
        ],
        ids=lambda spec: str(spec)[:60],
    )
    def test_invalid_specs_are_rejected(self, spec: object) -> None:
        with pytest.raises(MotionMindError):
            from_spec(spec)  # type: ignore[arg-type]


finite = st.floats(-360.0, 360.0).map(lambda angle: round(angle, 2) + 0.0)
turns = st.lists(st.tuples(st.sampled_from("xyz"), finite), max_size=4)
quaternions = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.01)
entries = st.one_of(turns.map(lambda ts: ", ".join(f"{axis} {angle}" for axis, angle in ts)), quaternions)
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
tables = st.dictionaries(
    st.sampled_from(["pelvis", "hip", "left_knee", "right_knee", "shoulder"]),
    st.dictionaries(words.filter(lambda name: name.strip() != ""), entries, min_size=1, max_size=5),
    min_size=1,
)


class TestLibrary:
    @pytest.mark.long
    @given(tables, words, words, words)
    @settings(max_examples=80, deadline=None)
    def test_what_is_written_is_read_back(self, states: dict, title: str, author: str, licence: str) -> None:
        try:
            library = Library(states, title, author, licence)
        except FormatError as error:
            if "same orientation" not in str(error):
                raise
            return
        again = parse_library(format_library(library))
        assert (again.title, again.author, again.licence, again.skeleton) == (title, author, licence, "human23")
        assert {t: list(e) for t, e in again.tables.items()} == {t: list(e) for t, e in states.items()}
        for table in states:
            assert rot.angle(again.rotations(table), library.rotations(table)).max() < 1e-8
        assert format_library(again) == format_library(parse_library(format_library(again)))

    @given(turns)
    @settings(max_examples=100, deadline=None)
    def test_turns_follow_each_other(self, sequence: list[tuple[str, float]]) -> None:
        expected = rot.IDENTITY
        for axis, angle in sequence:
            expected = rot.mul(expected, rot.from_axis_angle(np.eye(3)["xyz".index(axis)], np.radians(angle)))
        q = parse_turns(", ".join(f"{axis} {angle}" for axis, angle in sequence))
        assert rot.angle(q, expected) < 1e-12
        text = format_turns(q)
        assert text is None or rot.angle(parse_turns(text), q) < 1e-9

    @pytest.mark.parametrize("text", ["", "x -90", "x -90, y 45", "y 180", "x 12.25, z -7"])
    def test_plain_turns_stay_plain(self, text: str) -> None:
        q = parse_turns(text)
        assert rot.angle(parse_turns(format_turns(q) or ""), q) < 1e-9
        assert len(format_turns(q) or "") <= len(text)

    def test_a_leg_in_front_and_turned_out(self) -> None:
        q = parse_turns("x -90, y 45")
        # The left leg hangs down at rest and its foot points to +Z; +X is to the left.
        assert np.allclose(rot.mul_vec(q, np.array([0.0, -1.0, 0.0])), [0.0, 0.0, 1.0])
        assert np.allclose(rot.mul_vec(q, np.array([0.0, 0.0, 1.0])), np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0))

    def test_the_right_side_is_a_mirror(self) -> None:
        space = ExpertLibrary(parse_library(SMALL)).fit(NAMES, random_rotations(9, 4))
        assert np.allclose(space.of("right_hip"), rot.canonical(rot.mirror(space.of("left_hip"))))
        assert space.labels[1] == space.labels[2] == ("rest", "devant 90", "devant 90 turned out")

    def test_all_listed_states_exist_and_unlisted_joints_learn_theirs(self) -> None:
        q = np.tile(rot.IDENTITY, (4, 4, 1))
        q[:, 3] = rot.from_axis_angle([1.0, 0.0, 0.0], np.radians([0.0, 1.0, 100.0, 101.0]))
        space = ExpertLibrary(parse_library(SMALL), 30.0).fit(NAMES, q)
        assert space.sizes.tolist() == [2, 3, 3, 2]
        assert space.labels[3] == ()

    def test_a_single_side_may_have_its_own_table(self) -> None:
        library = parse_library(SMALL.replace("[hip]", "[right_hip]"))
        space = ExpertLibrary(library).fit(NAMES, random_rotations(9, 4))
        assert space.labels[1] == ()
        assert np.allclose(space.of("right_hip"), rot.canonical(library.rotations("right_hip")))

    def test_written_files_are_readable_and_whole(self, tmp_path: Path) -> None:
        path = tmp_path / "mine.toml"
        write_library(path, parse_library(SMALL))
        assert '"devant 90 turned out" = "x -90, y 45"' in path.read_text()
        assert '"front" = ""' in path.read_text()
        assert [file.name for file in tmp_path.iterdir()] == ["mine.toml"]
        assert read_library(path) == parse_library(path.read_text())
        with pytest.raises(MotionMindError, match="cannot be written"):
            write_library(tmp_path / "no" / "folder.toml", parse_library(SMALL))

    @pytest.mark.parametrize(
        ("old", "new", "says"),
        [
            ("[hip]", "[hipp]", r"\[hipp\].*did you mean hip"),
            ("[0, 0, 0, 2]", "[0, 0, 0, 0]", r'\[pelvis\] "front".*length zero'),
            ("[0, 0, 0, 2]", "[0, 0, 0]", r'\[pelvis\] "front".*quaternion'),
            ("[0, 0, 0, 2]", "[0, 0, true, 1]", r'\[pelvis\] "front"'),
            ("[0, 0, 0, 2]", "[0, 0, nan, 1]", "finite"),
            ("[0, 0, 0, 2]", f"[0, 0, 1{'0' * 400}, 1]", "finite"),
            ("[0, 0, 0, 2]", f"[0, 0, 1{'0' * 5000}, 1]", "not TOML"),
            ("[0, 0, 0, 2]", "7", r'\[pelvis\] "front".*quaternion'),
            ('"x -90, y 45"', '"x -90 y 45"', r'\[hip\] "devant 90 turned out".*not a turn'),
            ('"x -90, y 45"', '"w 30"', r'"devant 90 turned out".*not a turn'),
            ('"x -90, y 45"', '"x 361"', "360"),
            ('"x -90, y 45"', '"x -90,"', "not a turn"),
            ('"x -90, y 45"', '"x -90.001"', 'same orientation as "devant 90"'),
            ('"devant 90 turned out"', '"devant 90"', "not TOML.*line 10"),
            ('"devant 90 turned out"', '" "', "needs a name"),
            ("[pelvis]", "[hip]", "not TOML"),
            ("[pelvis]", "[left_hip]", r"left_hip is in \[hip\] and in \[left_hip\]"),
            ("[pelvis]", "[hip.more]", r'\[hip\] "more"'),
            ("version = 1", "version = 2", "version must be 1"),
            ("version = 1", "version = true", "version must be 1"),
            ("version = 1", "", "version must be 1"),
            ("motionmind-library", "motionmind-corpus", "motionmind-library"),
            ('title = "Two joints"', "title = 2", "title must be text"),
            ('title = "Two joints"', 'tittle = "Two joints"', "'tittle' is neither"),
        ],
    )
    def test_faults_are_named(self, tmp_path: Path, old: str, new: str, says: str) -> None:
        assert old in SMALL
        path = tmp_path / "faulty.toml"
        path.write_text(SMALL.replace(old, new, 1))
        with pytest.raises(FormatError, match=says) as caught:
            read_library(path)
        assert str(caught.value).startswith(f"{path}: ")

    def test_other_files_are_rejected(self, tmp_path: Path) -> None:
        (tmp_path / "latin.toml").write_bytes(b'title = "\xe9"')
        (tmp_path / "deep.toml").write_text("a = " + "[" * 100_000)
        (tmp_path / "folder.toml").mkdir()
        for name in ("latin.toml", "deep.toml", "folder.toml", "none.toml", "a\0b.toml"):
            with pytest.raises(FormatError):
                read_library(tmp_path / name)

    def test_text_that_no_file_can_hold(self) -> None:
        with pytest.raises(FormatError, match="not text"):
            Library({"hip": {"\ud800": ""}})

    @given(st.data())
    @settings(max_examples=150, deadline=None)
    def test_only_documented_errors_escape_from_mutated_files(self, data: st.DataObject) -> None:
        text = SMALL
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(0, len(text)))
            drop = data.draw(st.integers(0, 6))
            text = text[:at] + data.draw(st.text('[]"=,.-xyz019{}\n\\ é', max_size=4)) + text[at + drop :]
        with contextlib.suppress(MotionMindError):
            parse_library(text)


class TestBundled:
    def test_both_folders_are_found(self) -> None:
        assert (bundled("discretization") / "human23.toml").is_file()
        with pytest.raises(CorpusError, match="corpora and discretization"):
            bundled("etc")

    def test_a_wheel_carries_them_inside(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        (tmp_path / "motionmind").mkdir()
        there = tmp_path / "motionmind" / "bundled.py"
        monkeypatch.setattr("motionmind.bundled.__file__", str(there))
        with pytest.raises(CorpusError, match="missing"):
            bundled("corpora")
        (tmp_path / "corpora").mkdir()
        assert bundled("corpora") == tmp_path.resolve() / "corpora"
        inside = tmp_path / "motionmind" / "_bundled" / "corpora"
        inside.mkdir(parents=True)
        assert bundled("corpora") == inside.resolve()

    def test_the_library_names_every_joint_of_human23(self) -> None:
        library = read_library("human23")
        assert len(library.tables_of(human23().names)) == 23
        assert library.title
        assert library.author
        assert library.licence
        for table in library.tables:
            q = library.rotations(table)
            # Each state has a neighbour in reach, and none is crowded by another.
            apart = np.degrees(rot.angle(q[:, None], q[None])) + 999.0 * np.eye(len(q))
            assert apart.min() >= 19.0
            assert apart.min(axis=1).max() <= 45.0 + SLACK
            assert rot.angle(q, rot.IDENTITY).min() < 1e-9


@pytest.fixture(scope="module")
def dance() -> tuple[tuple[str, ...], np.ndarray]:
    """The joints of cmu-05 and its postures at 5 Hz, facing taken out [N, J, 4]."""
    folder = SHARED / "cmu-05"
    if not folder.is_dir():
        pytest.skip(f"real movement is not here: no folder {folder}")
    from motionmind.formats.bvh import read_bvh

    clips = [read_bvh(path) for path in sorted(folder.glob("*.bvh"))]
    q = np.concatenate([clip.slice(1, len(clip)).resample(5.0).rotations for clip in clips])
    q[:, 0] = rot.mul(rot.inv(rot.about_vertical(rot.heading(q[:, 0]))), q[:, 0])
    return clips[0].skeleton.names, q


@pytest.mark.parametrize(("tolerance", "most"), [(15.0, 210), (20.0, 140)])
def test_real_movement_needs_few_states(dance: tuple[tuple[str, ...], np.ndarray], tolerance: float, most: int) -> None:
    names, q = dance
    space = Codebook(tolerance).fit(names, q)
    distance = space.distance(q, space.assign(q))
    assert distance.max() <= tolerance + SLACK
    assert distance.mean() < tolerance / 3.0
    assert 100 < space.sizes.max() <= most
    for kind in ("quaternion", "euler"):
        grid = make_discretization(kind, tolerance).fit(names, q)
        assert grid.distance(q, grid.assign(q)).max() <= tolerance + SLACK
