"""The studio: the state that its parts share."""

from __future__ import annotations

import asyncio
import threading
from collections import OrderedDict
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from motionmind.jit import interpreted
from motionmind.render.page import player_data
from motionmind.studio.events import Events
from motionmind.studio.movements import Movements
from motionmind.studio.neighbours import MIRRORED
from motionmind.studio.preparation import Steps, Told, told
from motionmind.studio.project import Project
from motionmind.studio.settings import SetMusic
from motionmind.studio.thumbnails import THUMBNAIL_HEIGHT_PX, Thumbnails, thumbnail
from motionmind.studio.uploads import Uploads
from motionmind.studio.view import view_of
from motionmind.studio.worker_loop import MAX_ENGINES
from motionmind.studio.workers import Job, Workers

if TYPE_CHECKING:
    from motionmind.tween.engine import Engine


class Studio:
    """An open project, its workers and its event streams.

    Attributes:
        project: the project.
        home: the folder of the user's corpora; None for the default folder.
        events: events sent to the open windows.
        thumbnails: cache of small pictures.
        workers: the worker processes, set once the server runs.
        uploads: uploaded files, set by their routes.
        has_stopped: whether smoothing of seams is paused.
        is_shared: whether other computers can reach it.
    """

    workers: Workers
    uploads: Uploads

    def __init__(
        self,
        project: Project,
        home: Path | None = None,
        processes: int | None = None,
        first: Steps | None = None,
        is_shared: bool = False,
    ) -> None:
        """Set up a studio.

        Args:
            project: the project.
            home: the folder of the user's corpora; None for the default folder.
            processes: the number of workers; by default as many as this computer has room for.
            first: preparation that makes jobs fast; jobs wait for it.
            is_shared: whether other computers can reach it.
        """
        self.project, self.home, self.is_shared = project, home, is_shared
        self.events, self.thumbnails = Events(), Thumbnails()
        self.has_stopped = False
        self._shown: set[str] = set()
        self._processes, self._first = processes, first
        self._is_cold = first is not None
        self._engines: OrderedDict[str, Engine] = OrderedDict()
        project.subscribe(self._tell_of_project)

    @property
    def movements(self) -> Movements:
        """All movements, by key."""
        return self.project.movements

    def previewing(self) -> AbstractContextManager[None]:
        """Return a context for the first pictures: without compiled code, they do not wait for it."""
        return interpreted() if self._is_cold else nullcontext()

    def start(self) -> None:
        """Start the workers, in the event loop."""
        corpus = self.project.state.corpus
        self.workers = Workers(self.home, self._tell_of_job, corpus, self._processes)
        threading.Thread(target=self._draw_first, daemon=True).start()
        asyncio.get_running_loop().call_later(2.0, self.workers.begin)  # until the page has loaded
        if self._first is not None:
            self._preparing = asyncio.create_task(self._prepare(told(self._first)))

    async def _prepare(self, steps: Told) -> None:
        """Wait for compiled code."""
        await self.workers.prepare("getting ready", steps)
        self._is_cold = False

    def _draw_first(self) -> None:
        """Load the gallery and draw its first picture before the browser opens the page."""
        with suppress(Exception), self.previewing():  # a request for the picture reports the error
            collection = self.movements.collection(self.project.state.corpus)
            name = next(iter([*collection.postures, *collection.clips]))
            motion = collection.find(name, as_clip=False)
            player_data(motion)
            self.thumbnails.hold(
                f"{collection.word}/{name}", 0, THUMBNAIL_HEIGHT_PX, thumbnail(motion, 0, THUMBNAIL_HEIGHT_PX)
            )

    def close(self) -> None:
        """End the workers and release the project."""
        if self._first is not None:
            self._first.close()
        self.workers.close()
        self.project.close()

    def engine(self, name: str) -> Engine:
        """Return the engine of a corpus in this process, for questions that take a fraction of a second.

        Raises:
            MotionMindError: there is no such corpus.
        """
        from motionmind.tween.engine import Engine

        if name not in self._engines:
            self._engines[name] = Engine.load(name, self.home)
            while len(self._engines) > MAX_ENGINES:
                self._engines.popitem(last=False)
        self._engines.move_to_end(name)
        return self._engines[name]

    def forget(self, corpus: str) -> None:
        """Drop cached data of a corpus that was rebuilt or deleted."""
        self._engines.pop(corpus, None)
        self.project.look_again(corpus)

    def view(self, window: str) -> Mapping[str, Any]:
        """Return the project as a window sees it: `GET /api/project`."""
        project = self.project
        state = project.state
        return {
            "sequence": project.sequence,
            "access": "shared" if self.is_shared else "own",
            "title": state.title,
            "file": project.path.name,
            "saved": project.saved,
            "corpus": state.corpus,
            "corpora": project.versions,
            "tempo": state.tempo,
            "counts": state.counts,
            "reference": {"path": state.reference.path, "begins": state.reference.begins},
            "stage": state.stage,
            "music": msgspec.structs.asdict(state.music),
            "words": project.words,
            "missing": project.missing,
            "postures": [{"name": name, "key": key} for name, key in state.postures.items()],
            "cast": state.cast._asdict(),
            "piece": view_of(state, project.finding, project.marks, project.movements.title, project.standing),
            "undo": project.undoable(window),
            "redo": project.redoable(window),
        }

    def look(self) -> Mapping[str, Any]:
        """Return the project as the look-only link shows it: the piece and its notes."""
        whole = self.view("-")
        piece = whole["piece"]
        dancers = self.project.state.cast.dancers
        shown = {one["key"] for one in (*piece["parts"], *piece["blocks"])} | {one.source for one in dancers} - {""}
        if any(one.mirrored for one in dancers):
            shown |= {key.removeprefix(MIRRORED) if key.startswith(MIRRORED) else MIRRORED + key for key in shown}
        self._shown |= shown
        nothing = {"file": "", "corpus": "", "corpora": {}, "words": [], "missing": [], "postures": []}
        nothing["reference"] = {"path": "", "begins": 0.0}
        nothing["music"] = msgspec.structs.asdict(SetMusic())
        shared = ("sequence", "title", "saved", "tempo", "counts", "stage", "cast")
        known = {name: whole[name] for name in shared}
        return known | nothing | {"access": "look", "piece": piece | {"seams": []}, "undo": None, "redo": None}

    def has_shown(self, key: str) -> bool:
        """Return whether the look-only link has shown a movement: it sees no others."""
        return key in self._shown

    def tell_of_smoothing(self, has_stopped: bool) -> None:
        """Tell the windows when smoothing stops or resumes."""
        if has_stopped != self.has_stopped:
            self.has_stopped = has_stopped
            self.events.send("smoothing", {"stopped": has_stopped})

    def _tell_of_project(self) -> None:
        self.events.send("project", {"sequence": self.project.sequence, "notices": len(self.project.words)})

    def _tell_of_job(self, job: Job) -> None:
        self.events.send("job", job.view(), job.id)
