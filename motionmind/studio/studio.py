"""The studio: the state that its parts share."""

from __future__ import annotations

import asyncio
import threading
from collections import OrderedDict
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from motionmind.errors import MotionMindError
from motionmind.render.page import player_data
from motionmind.studio.events import Events
from motionmind.studio.movements import Movements
from motionmind.studio.preparation import Steps, told
from motionmind.studio.project import Project
from motionmind.studio.thumbnails import THUMBNAIL_HEIGHT_PX, Thumbnails, thumbnail
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
        has_stopped: whether smoothing of seams is paused.
    """

    workers: Workers

    def __init__(
        self,
        project: Project,
        home: Path | None = None,
        processes: int | None = None,
        first: Steps | None = None,
    ) -> None:
        """Set up a studio.

        Args:
            project: the project.
            home: the folder of the user's corpora; None for the default folder.
            processes: the number of workers; by default as many as this computer has room for.
            first: preparation that makes jobs fast; jobs wait for it.
        """
        self.project, self.home = project, home
        self.events, self.thumbnails = Events(), Thumbnails()
        self.has_stopped = False
        self._processes, self._first = processes, first
        self._engines: OrderedDict[str, Engine] = OrderedDict()
        project.subscribe(self._tell_of_project)

    @property
    def movements(self) -> Movements:
        """All movements, by key."""
        return self.project.movements

    def start(self) -> None:
        """Start the workers, in the event loop."""
        corpus = self.project.state.corpus
        self.workers = Workers(self.home, self._tell_of_job, corpus, self._processes)
        threading.Thread(target=self._draw_first, daemon=True).start()
        asyncio.get_running_loop().call_later(2.0, self.workers.begin)  # until the page has loaded
        if self._first is not None:
            self._preparing = asyncio.create_task(self.workers.prepare("getting ready", told(self._first)))

    def _draw_first(self) -> None:
        """Load the gallery and draw its first picture before the browser opens the page."""
        with suppress(MotionMindError):
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
            "title": state.title,
            "file": project.path.name,
            "corpus": state.corpus,
            "corpora": project.versions,
            "words": project.words,
            "missing": project.missing,
            "postures": [{"name": name, "key": key} for name, key in state.postures.items()],
            "piece": view_of(state, project.finding, project.marks, project.movements.title, project.standing),
            "undo": project.undoable(window),
            "redo": project.redoable(window),
        }

    def tell_of_smoothing(self, has_stopped: bool) -> None:
        """Tell the windows when smoothing stops or resumes."""
        if has_stopped != self.has_stopped:
            self.has_stopped = has_stopped
            self.events.send("smoothing", {"stopped": has_stopped})

    def _tell_of_project(self) -> None:
        self.events.send("project", {"sequence": self.project.sequence})

    def _tell_of_job(self, job: Job) -> None:
        self.events.send("job", job.view(), job.id)
