"""Values that shells complete: corpora, postures, clips of corpora and glTF files, joints and flows.

A shell starts the program for each tab, so nothing here imports numpy or parses a score: names come from manifests and
from lines of scores that define them. Unreadable files complete to nothing.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import click
from click.shell_completion import CompletionItem

from motionmind.clip_names import read_names, split_clip
from motionmind.errors import MotionMindError

FLOWS = ("chua", "duffing", "halvorsen", "lorenz", "rossler", "thomas")  # as `motionmind.chaos.flows.FLOWS`
_NAMING_LINE = re.compile(r"(posture|clip|include)[ \t]+([^\s:=]+)")


class _Names(NamedTuple):
    """The names of a corpus's postures, clips and joints."""

    postures: list[str]
    clips: list[str]
    joints: list[str]


def corpora(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a corpus."""
    return [CompletionItem(name) for name in _folders(context) if name.startswith(incomplete)]


def own_corpora(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a corpus that the user built."""
    from motionmind.bundled import bundled

    places = _folders(context).items()
    own = [name for name, folder in places if folder.parent != bundled("corpora")]
    return [CompletionItem(name) for name in own if name.startswith(incomplete)]


def published(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a corpus or a recipe in the indexes on this disk."""
    from motionmind.registry.index import is_address, open_index

    chosen = context.params.get("index")
    names = dict[str, None]()
    for place in [chosen, None] if chosen and not is_address(chosen) else [None]:
        with suppress(MotionMindError):
            names |= dict.fromkeys(one.name for one in open_index(place).index.all)
    return [CompletionItem(name) for name in names if name.startswith(incomplete)]


def postures(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a posture of a corpus, a clip of a glTF file, or a file; a clip completes to its first posture."""
    return _complete_named(context, incomplete, "@0")


def movement(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a clip or a posture of a corpus, a clip of a glTF file, or a file."""
    return _complete_named(context, incomplete, "")


def joints(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete a joint of the command's corpus, the last in a comma-separated list."""
    before, comma, last = incomplete.rpartition(",")
    # Arguments before an option without a value yet are in `args`, not in a parameter.
    words = (context.params.get(name) for name in ("corpus", "a", "b"))
    places = [str(word).partition("/")[0] for word in (*words, *context.args) if word]
    corpus = next((place for place in places if place in _folders(context)), "")
    names = _names(context, corpus).joints
    return [CompletionItem(f"{before}{comma}{name}") for name in names if name.startswith(last)]


def flows(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete the name of a flow."""
    from motionmind.plugins import added

    return [CompletionItem(name) for name in (*FLOWS, *added("motionmind.flows")) if name.startswith(incomplete)]


def _complete_named(context: click.Context, incomplete: str, suffix: str) -> list[CompletionItem]:
    """Complete names in corpora and glTF files, and files; append `suffix` to the name of a clip."""
    file, clip = split_clip(incomplete)
    if clip is not None:
        clips = read_names(file)
        return [CompletionItem(f"{file}#{name}{suffix}") for name in clips if name.startswith(clip)]
    word, slash, _ = incomplete.partition("/")
    known = [name for name in _folders(context) if (name == word if slash else name.startswith(word))]
    found = [f"{name}/" for name in known]
    if len(known) == 1:  # else the shell would stop at each corpus, and list hundreds
        names = _names(context, known[0])
        found = [f"{known[0]}/{name}" for name in names.postures]
        found += [f"{known[0]}/{clip}{suffix}" for clip in names.clips if clip not in names.postures or suffix]
    items = [CompletionItem(name) for name in found if name.startswith(incomplete)]
    if slash and items:
        return items
    files = [CompletionItem(name) for name in _files(incomplete)]
    return [*items, *files] if items else [CompletionItem(incomplete, type="file")]


def _files(incomplete: str) -> list[str]:
    """Return the files of the current folder that begin with `incomplete`."""
    return sorted(path.name for path in Path().iterdir() if path.is_file() and path.name.startswith(incomplete))


def _folders(context: click.Context) -> dict[str, Path]:
    """Return the corpora's folders by name."""
    from motionmind.corpus.store import list_corpora

    with suppress(MotionMindError, OSError):
        return list_corpora(context.params.get("home"))
    return {}


def _names(context: click.Context, corpus: str) -> _Names:
    """Return the names of a corpus."""
    from motionmind.corpus.cache import cache_folder
    from motionmind.corpus.store import MANIFEST

    folder = _folders(context).get(corpus)
    if folder is None:
        return _Names([], [], [])
    built, manifest = folder, _manifest(folder)
    learned = manifest
    if "skeleton" not in manifest:  # a corpus that people wrote: its joints are in what was learned from it last
        kept = sorted(
            cache_folder("corpora").glob(f"{folder.name}-*/{MANIFEST}"), key=lambda path: path.stat().st_mtime
        )
        built = kept[-1].parent if kept else folder
        learned = _manifest(built) if kept else {}
    with suppress(TypeError, KeyError, AttributeError, OSError, ValueError):
        named = list(_scanned(folder, manifest.get("scores", [])))
        clips = [
            str(clip["name"]) for clip in _entries(built, learned) if not (clip.get("mirrored") or clip.get("corpus"))
        ]
        return _Names(
            list(dict.fromkeys(name for kind, name in named if kind == "posture")),
            clips or [name for kind, name in named if kind == "clip"],
            [str(name) for name in learned.get("skeleton", {}).get("names", [])],
        )
    return _Names([], [], [])


def _entries(folder: Path, manifest: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the entries of a built corpus's clips."""
    if "folder" not in manifest:
        return []
    data = (folder / str(manifest["folder"]) / "clips.text.npy").read_bytes()
    header = 10 + int.from_bytes(data[8:10], "little")  # of NumPy's format, version 1.0
    return [json.loads(line) for line in data[header:].splitlines()]


def _manifest(folder: Path) -> dict[str, Any]:
    from motionmind.corpus.store import MANIFEST

    with suppress(OSError, ValueError, RecursionError):
        found = json.loads((folder / MANIFEST).read_bytes())
        if isinstance(found, dict):
            return found
    return {}


def _scanned(folder: Path, scores: list[str]) -> Iterator[tuple[str, str]]:
    """Yield ("posture", name) and ("clip", name) for definitions in scores and their includes."""
    waiting = [folder / str(score) for score in scores]
    for path in waiting:  # the list grows during the loop
        lines: list[str] = []
        with suppress(OSError, ValueError):
            lines = path.read_text("utf-8").splitlines()
        for line in lines:
            found = _NAMING_LINE.match(line)
            if found and found[1] != "include":
                yield found[1], found[2]
            elif found and " as " not in line and len(waiting) < 100:
                included = path.parent / found[2]
                waiting += [] if included in waiting else [included]
