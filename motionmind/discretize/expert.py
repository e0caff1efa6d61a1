"""States that an expert named, from a library file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from motionmind._typing import Floats
from motionmind.discretize.codebook import codebook
from motionmind.discretize.library import Library, library_to_mapping, read_library
from motionmind.discretize.protocol import check_range, per_joint_values, samples
from motionmind.discretize.states import StateSpace
from motionmind.files import FilePath


@dataclass(frozen=True)
class ExpertLibrary:
    """The states of a library, all of them and no others, whether the corpus visits them or not.

    An orientation belongs to the nearest state, however far: `StateSpace.distance` tells how far, and what lies
    beyond the tolerance is not in the expert's vocabulary.

    A joint that the library does not list gets the states of a learned codebook, without names. A single state
    would freeze the joint without a word, and to refuse would ask for names for thumbs before those for hips can
    be tried; this way nothing that moves is lost, and `StateSpace.labels` shows which joints still want names.

    Attributes:
        library: the states, by joint.
        tolerance: degrees, 0.01 to 180: within which a named state stands for an orientation, and the codebook's
            tolerance for joints that are not listed.
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
        """From a file, or the bundled library of that name; see `read_library`."""
        return cls(read_library(name_or_path), tolerance, per_joint or {})

    def fit(self, names: Sequence[str], rotations: Floats) -> StateSpace:
        """The library's states for `names` [J]; see `Discretization.fit`."""
        rotations = samples(names, rotations)
        tolerances = per_joint_values(names, self.tolerance, self.per_joint)
        tables = self.library.tables_of(names)
        centres: list[Floats] = []
        labels: list[tuple[str, ...]] = []
        for j, name in enumerate(names):
            table = tables.get(j)
            if table is None:
                centres.append(codebook(rotations[:, j], float(tolerances[j])))
                labels.append(())
            else:
                centres.append(self.library.of_joint(table, name))
                labels.append(tuple(self.library.tables[table]))
        return StateSpace.of_joints(names, centres, kind=self.kind, tolerances=tolerances, labels=labels)

    def to_spec(self) -> dict[str, object]:
        """The whole library, so that a manifest can be read where its file is not; as `from_spec` reads it.

        Whoever stores it must keep the order of keys: it numbers the states.
        """
        return {
            "kind": self.kind,
            "library": library_to_mapping(self.library),
            "tolerance": self.tolerance,
            "per_joint": dict(self.per_joint),
        }
