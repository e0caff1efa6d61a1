"""LearnedCorpus: learn, load and save a corpus."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Self, Unpack

from motionmind.arguments import check_mapping, check_options, check_path, check_type
from motionmind.body.motion import Motion
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.gather import Gathering, gather
from motionmind.corpus.recordings import Recording
from motionmind.discretize.codebook import Codebook
from motionmind.discretize.protocol import Discretization
from motionmind.executors.workshop import Workshop
from motionmind.learned import persistence
from motionmind.learned.learning import Learned, learn

_DISCRETIZATION = "a Discretization, as make_discretization makes"


@dataclass(frozen=True, eq=False)
class LearnedCorpus(Learned):
    """A learned corpus (see `Learned`), with its loading time.

    Attributes:
        load_seconds: loading time, seconds; 0 if it was not loaded.
    """

    load_seconds: float = 0.0

    @classmethod
    def fit(
        cls,
        clips: Iterable[Motion | Recording] = (),
        *,
        name: str = "corpus",
        discretization: Discretization | None = None,
        mix: Mapping[str, float] | None = None,
        home: str | os.PathLike[str] | None = None,
        workshop: Workshop | None = None,
        **options: Unpack[Gathering],
    ) -> Self:
        """Learn from clips, which must have the same joints (`own_skeleton` retargets known rigs).

        Args:
            clips: the movement; reports name the clip that each move comes from.
            name: name of the corpus.
            discretization: how orientations become states; by default a learned codebook of 15 degrees.
            mix: other corpora to learn from as well, by name or folder, each with the weight of its postures and moves;
                `clips` have weight 1.
            home: the folder of the corpora that `mix` names.
            workshop: threads, and room for large arrays; None for this thread and memory. It does not affect the
                result.
            options: how recordings become clips, and whose they are, as for `motionmind.corpus.gather.gather`.

        Raises:
            CorpusError: there is nothing to learn from, clips are on different joints, there are too many states, or a
                corpus to mix does not exist.
            SkeletonError: the body cannot be mirrored.
            WrongTypeError: an argument has the wrong type, or an option does not exist.
        """
        check_options("fit", options, Gathering, cls.fit)
        check_type("discretization", discretization, Discretization, wanted=_DISCRETIZATION, or_none=True)
        check_mapping("mix", mix, or_none=True)
        check_path("home", home, or_none=True)
        check_type("workshop", workshop, Workshop, or_none=True)
        others = [(persistence.load_corpus(other, home), weight) for other, weight in (mix or {}).items()]
        corpus = gather(name, clips, mix=others, workshop=workshop, **options)
        return cls.learn(corpus, discretization or Codebook(15.0), workshop)

    @classmethod
    def learn(cls, corpus: Corpus, discretization: Discretization, workshop: Workshop | None = None) -> Self:
        """Learn from a corpus; see `motionmind.learned.learning.learn`."""
        check_type("corpus", corpus, Corpus)
        check_type("discretization", discretization, Discretization, wanted=_DISCRETIZATION)
        check_type("workshop", workshop, Workshop, or_none=True)
        return cls._of(learn(corpus, discretization, workshop))

    @classmethod
    def load(cls, name: str, home: str | os.PathLike[str] | None = None) -> Self:
        """Load a built or bundled corpus, by its name or folder.

        Learned data missing from the user's cache folder is learned and stored there.

        Args:
            name: the corpus's name or folder.
            home: the folder of the user's corpora.

        Raises:
            CorpusError: there is no such corpus; the message names the existing ones.
            FormatError: it cannot be read.
        """
        check_path("home", home, or_none=True)
        began = perf_counter()
        learned = persistence.load(name, home)
        return cls._of(learned, perf_counter() - began)

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write the corpus to a folder, completely or not at all, and cache the learned data.

        Args:
            folder: the folder; a built corpus in it is replaced, and kept beside the new one until the next change
                (`motionmind corpus restore` brings it back).

        Raises:
            CorpusError: the folder cannot be written, or holds anything but a built corpus.
        """
        check_path("folder", folder)
        persistence.save(self, folder)

    @classmethod
    def _of(cls, learned: Learned, load_seconds: float = 0.0) -> Self:
        return cls(
            learned.corpus,
            learned.space,
            learned.states,
            learned.grammar,
            learned.statistics,
            learned.pace,
            learned.plausibility,
            learned.gauge,
            load_seconds=load_seconds,
        )
