"""The page's code: types, rules, and files that one can read in one go.

What checks it is installed for node, outside of the checkout, as `.ci/run` does; without it these tests are skipped.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
STUDIO = ROOT / "motionmind" / "studio"
PAGE, PLAYER = STUDIO / "page", ROOT / "motionmind" / "render" / "player"
LONGEST = 400  # lines of a file


def _installed(package: str) -> Path:
    """The folder of a package for node; the test is skipped without it."""
    node = shutil.which("node")
    asked = f"require.resolve({json.dumps(package + '/package.json')})"
    found = node and subprocess.run([node, "-p", asked], capture_output=True, text=True, check=False, cwd=ROOT)
    if not found or found.returncode:
        pytest.skip(f"{package} is not here (install it for node, and set NODE_PATH)")
    return Path(found.stdout.strip()).parent


def _node(*arguments: str | Path, cwd: Path) -> str:
    ran = subprocess.run(
        ["node", *map(str, arguments)], capture_output=True, text=True, check=False, cwd=cwd, env=os.environ
    )
    return ran.stdout + ran.stderr


def test_types_are_right(tmp_path: Path) -> None:
    compiler, three = _installed("typescript"), _installed("@types/three")
    options = {
        "allowJs": True,
        "checkJs": True,
        "noEmit": True,
        "strict": True,
        "noImplicitAny": False,  # callbacks within templates would need a type each
        "skipLibCheck": True,
        "target": "es2023",
        "module": "esnext",
        "moduleResolution": "bundler",
        "lib": ["es2023", "dom", "dom.iterable", "dom.asynciterable"],
        "types": [],
        "paths": {
            "three": [str(three / "build" / "three.module.d.ts")],
            "three/OrbitControls": [str(three / "examples" / "jsm" / "controls" / "OrbitControls.d.ts")],
            "motionmind/*": [str(PLAYER / "*.js")],
        },
    }
    config = tmp_path / "tsconfig.json"
    files = sorted(str(file) for file in PAGE.rglob("*.js") if "vendor" not in file.parts)
    config.write_text(json.dumps({"compilerOptions": options, "files": files}), encoding="utf-8")
    said = _node(compiler / "bin" / "tsc", "--pretty", "false", "-p", config, cwd=ROOT)
    # The player's modules, and what is bundled, are seen only through what the page takes from them.
    own = [line for line in said.splitlines() if re.match(r"\S*motionmind/studio/page/(?!vendor/)", line)]
    assert not own, "\n".join(own)
    assert "error TS5" not in said, said  # the options are understood
    assert "error TS6" not in said, said


def test_rules_are_kept() -> None:
    linter = _installed("eslint")
    for package in ("@eslint/js", "globals"):
        _installed(package)
    config = Path(__file__).with_name("eslint.config.mjs")
    said = _node(linter / "bin" / "eslint.js", "--config", config, ".", cwd=PAGE)
    assert not said.strip(), said


@pytest.mark.parametrize("kind", [".py", ".js", ".css"])
def test_no_file_is_long(kind: str) -> None:
    files = [file for file in STUDIO.rglob(f"*{kind}") if "vendor" not in file.parts]
    assert files
    lengths = {file.name: len(file.read_text(encoding="utf-8").splitlines()) for file in files}
    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}


def test_each_letter_is_one_key() -> None:
    """While the time line has the focus, no letter of its keys has another meaning elsewhere.

    The look-only page has neither the time line nor the panels; its letters are none of the viewer's.
    """
    line = PAGE / "timeline" / "keys.js"
    own = re.findall(r'^  \["([a-z])", "",', line.read_text("utf-8"), re.M)
    heard: dict[str, list[str]] = {}
    for file in PAGE.rglob("*.js"):
        heard.setdefault(file.parent.name, []).extend(re.findall(r'keys: \["([a-z])"\]', file.read_text("utf-8")))
    looking = heard.pop("look")
    editing = own + [letter for letters in heard.values() for letter in letters]
    shared = heard["shell"] + heard["view"]
    for letters in (own, looking, shared):
        assert letters
    assert len(set(editing)) == len(editing), sorted(editing)
    assert len({*looking, *shared}) == len(looking) + len(shared), sorted(looking + shared)
