"""Expert libraries as a discretization: the states that an expert named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from motionmind._typing import Floats
from motionmind.discretize.codebook import codebook
from motionmind.discretize.library import Library, library_to_mapping, read_library
from motionmind.discretize.protocol import check_range, fit_joints, per_joint_values
from motionmind.discretize.states import StateSpace
from motionmind.files import FilePath


@dataclass(frozen=True)
class ExpertLibrary:
    """All states of a library and no others, whether the corpus visits them or not.

    An orientation belongs to the nearest state, however far. `StateSpace.distance` returns the angle; beyond the
    tolerance an orientation is not in the expert's vocabulary.

    A joint that the library does not list gets the states of a learned codebook, without labels: a single state would
    silently freeze the joint, and an error would demand names for thumbs before names for hips can be tried.
    `StateSpace.labels` shows which joints still need names.

    Attributes:
        library: the states, by joint.
        tolerance: degrees, 0.01 to 180, within which a named state represents an orientation; also the tolerance of the
            codebooks for joints that are not listed.
        per_joint: degrees for single joints; "hip" means both hips.
    """

    library: Library
    tolerance: float = 30.0
    per_joint: Mapping[str, float] = field(default_factory=dict)
    kind: ClassVar[str] = "library"

    def __post_init__(self) -> None:
        check_range("tolerance in degrees", {"": self.tolerance, **self.per_joint}, 0.01, 180.0)

    @classmethod
    def read(
        cls,
        name_or_path: FilePath,
        tolerance: float = 30.0,
        per_joint: Mapping[str, float] | None = None,
    ) -> ExpertLibrary:
        """Read a library from a file, or the bundled one of that name.

        Args:
            name_or_path: see `read_library`.
            tolerance: degrees.
            per_joint: degrees for single joints.

        Raises:
            FormatError: there is no such library, or the file cannot be read as one.
            MotionMindError: a tolerance is out of range.
        """
        return cls(read_library(name_or_path), tolerance, per_joint or {})

    def fit(self, names: Sequence[str], rotations: Floats) -> StateSpace:
        """Return the library's states for `names` [J]; see `Discretization.fit`."""
        return fit_joints(self, names, rotations)

    def fit_joint(self, names: Sequence[str], joint: int, rotations: Floats) -> StateSpace:
        """Return the library's states for one of the joints, of `rotations` [N, 4]; see `ByJoint.fit_joint`."""
        tolerances = per_joint_values(names, self.tolerance, self.per_joint)[[joint]]
        table = self.library.tables_of(names).get(joint)
        centres = (
            codebook(rotations, float(tolerances[0])) if table is None else self.library.of_joint(table, names[joint])
        )
        labels = () if table is None else tuple(self.library.tables[table])
        return StateSpace.of_joints([names[joint]], [centres], kind=self.kind, tolerances=tolerances, labels=[labels])

    def to_spec(self) -> dict[str, object]:
        """Return the whole library, as `from_spec` reads it: a manifest must be readable without the library's file.

        The order of its keys numbers the states, and must be kept.
        """
        return {
            "kind": self.kind,
            "library": library_to_mapping(self.library),
            "tolerance": self.tolerance,
            "per_joint": dict(self.per_joint),
        }
