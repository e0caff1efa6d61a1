"""The last digit decides nothing: tweens are the same on processors that round sums and sines in other ways."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy._core import _multiarray_umath as processor  # type: ignore[attr-defined]

from motionmind.codecache import place_of_code
from motionmind.geometry import rotations as rot

PAIRS = 6
SCRIPT = f"""
import sys, warnings
from pathlib import Path
import numpy as np
from motionmind import Engine, own_skeleton, read_motion
from motionmind.body.motion import Posture

warnings.simplefilter("ignore")
_, out, *files = sys.argv
clips = [own_skeleton(read_motion(path)) for path in files]
engine = Engine.fit(clips, facing="free", skip=1) if clips else Engine.load("ballet")
corpus, found = engine.corpus, {{"rotations": engine.corpus.rotations}}
for k, (a, b) in enumerate(np.random.default_rng(0).integers(0, len(corpus), ({PAIRS}, 2))):
    ends = (Posture(corpus.skeleton, corpus.rotations[i], corpus.root[i]) for i in (a, b))
    tween = engine.tween(*ends)
    found |= {{f"path{{k}}": tween.path, f"cost{{k}}": tween.cost, f"motion{{k}}": tween.motion.rotations}}
np.savez(out, **found)
"""


def run(folder: Path, files: list[Path], **environment: str) -> dict[str, np.ndarray]:
    """Learn and tween in a process of its own, which compiles nothing that is compiled here."""
    compiled = place_of_code()
    assert compiled is not None
    own = {"XDG_CACHE_HOME": str(folder), "NUMBA_CACHE_DIR": str(compiled.parent)}
    folder.mkdir()
    command = [sys.executable, "-c", SCRIPT, str(folder / "found.npz"), *map(str, files)]
    subprocess.run(command, check=True, env={**os.environ, **own, **environment})
    with np.load(folder / "found.npz") as found:
        return dict(found)


@pytest.mark.long
@pytest.mark.parametrize("subject", ["", "cmu-05"])
def test_tweens_are_the_same_with_and_without_avx2(
    subject: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    features = [one for one in processor.__cpu_dispatch__ if processor.__cpu_features__[one]]
    if not {"AVX2", "X86_V3"} & set(features):
        pytest.skip("this processor has no AVX2")
    files = sorted((request.getfixturevalue("shared_data") / subject).glob("*.bvh"))[:8] if subject else []
    usual = run(tmp_path / "usual", files)
    plain = run(tmp_path / "plain", files, NPY_DISABLE_CPU_FEATURES=" ".join(features), OPENBLAS_CORETYPE="Nehalem")
    for k in range(PAIRS):
        np.testing.assert_array_equal(usual[f"path{k}"], plain[f"path{k}"])
        assert usual[f"cost{k}"] == pytest.approx(plain[f"cost{k}"], abs=1e-9, rel=0.0)
        # Where a leg is nearly straight, its bend is known to the root of rounding.
        assert rot.angle(usual[f"motion{k}"], plain[f"motion{k}"]).max() < 1e-6
    if subject and not (usual["rotations"] != plain["rotations"]).any():
        pytest.skip("this processor rounds recordings alike with and without AVX2: nothing was tried")
    if not subject:
        np.testing.assert_array_equal(usual["rotations"], plain["rotations"])
