"""Puts compiled code into a wheel, for any processor of this platform and for newer ones.

    HATCH_BUILD_HOOK_ENABLE_CUSTOM=true python -m build --wheel

Without the variable a wheel is made of sources alone, in seconds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

_WARM = """
import sys
sys.path.insert(0, sys.argv[1])
from motionmind.cli import main
main(["warm"])
"""


class CompiledCode(BuildHookInterface):
    """Compiles the inner loops with `motionmind warm` for each target, and adds an archive of each to the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and name what is to be added."""
        sys.path.insert(0, self.root)
        from motionmind.codecache import targets

        self._room = tempfile.TemporaryDirectory()
        room = Path(self._room.name)
        for target in targets():
            own = {"NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(room / target)}
            places = {"XDG_CACHE_HOME": str(room / "cache")}
            subprocess.run(
                [sys.executable, "-P", "-c", _WARM, self.root], env={**os.environ, **own, **places}, check=True
            )
            archive = room / f"{target}.zip"
            code = room / target / "compiled"
            with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
                for file in sorted(code.glob("*/*.nbc")):
                    packed.write(file, file.relative_to(code))
            build_data["force_include"][str(archive)] = f"motionmind/_compiled/{archive.name}"
        build_data["pure_python"] = False
        build_data["infer_tag"] = True

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was added."""
        self._room.cleanup()
