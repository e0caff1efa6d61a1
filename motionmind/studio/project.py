"""An open project: its facts, its edits, and the state that those of them lead to that are not undone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from motionmind.display import displayed
from motionmind.errors import FormatError, MotionMindError, enumerated
from motionmind.studio import piece
from motionmind.studio.checks import check_movements, check_names, corpora_of, missing_in
from motionmind.studio.edits import Edit, SetCorpus, Wish, touched, words_of
from motionmind.studio.journal import Journal
from motionmind.studio.movements import Movements, version_of
from motionmind.studio.piece import End, Finding, Found, Pair, Seam, State
from motionmind.studio.placement import Marks
from motionmind.studio.questions import question_of
from motionmind.studio.records import Corpora, EditLine, Head, RedoLine, UndoLine, decode_line
from motionmind.studio.view import chosen_at

_EVERY = 16  # edits after which the state is remembered, so that an undo need not apply all of them again


class RefusedError(MotionMindError):
    """Nothing was done, for as things stand it cannot be."""


@dataclass
class Change:
    """An edit of the project.

    Attributes:
        number: its number; later edits have greater ones.
        edit: the edit.
        window: the window in which it was done.
        undone: whether it is taken back.
    """

    number: int
    edit: Edit
    window: str
    undone: bool = False


class Project:
    """A project that this process holds.

    Attributes:
        movements: all movement by key.
        marks: marks of the movements.
        state: what the edits lead to.
        versions: the version of each corpus that it names.
        words: what there is to say of it since it was opened, such as that a corpus has changed.
    """

    def __init__(self, journal: Journal, home: Path | None = None) -> None:
        """Read a project's file; errors as of `open`."""
        self._journal, self._home = journal, home
        self.movements = Movements(journal, home)
        self.marks = Marks(self.movements.get, self.movements.facing)
        self.movements.saved = self._saved
        self.versions: dict[str, str] = {}
        self.words: list[str] = []
        self._changes: list[Change] = []
        self._redoable: dict[str, list[Change]] = {}  # by window, the last to be redone first
        self._findings: dict[str, Finding] = {}
        self._stood: dict[Pair, tuple[tuple[End, End], Found]] = {}  # what was inserted before it was asked anew
        self._subscribers: list[Callable[[], None]] = []
        self._windows: set[str] = set()  # that were seen since it was opened
        self._states: list[State] = []  # before the first change, and after each `_EVERY` changes more
        self.state = State()
        if journal.dropped:
            self.words.append("the last edit was not written whole when the studio ended, and is gone")
        self._read()

    @classmethod
    def create(cls, path: Path, corpus: str, home: Path | None = None, title: str = "") -> Self:
        """Make a new project with no edits.

        Args:
            path: its file, which is not there yet.
            corpus: the corpus that judges and smooths.
            home: the folder of the user's corpora; None for the usual one.
            title: its title; the file's name by default.

        Raises:
            MotionMindError: there is no such corpus, or the file cannot be written.
        """
        versions = {corpus: version_of(corpus, home)}
        title = displayed(title or path.stem)
        return cls(Journal.create(path, title=title, corpus=corpus, corpora=versions), home)

    @classmethod
    def open(cls, path: Path, home: Path | None = None) -> Self:
        """Open a project.

        Raises:
            FormatError: it is no project, or damaged.
            MotionMindError: it is open elsewhere.
        """
        journal = Journal.open(path)
        try:
            return cls(journal, home)
        except BaseException:
            journal.close()
            raise

    def close(self) -> None:
        """Let others open it."""
        self._journal.close()

    @property
    def path(self) -> Path:
        """The file."""
        return self._journal.path

    @property
    def sequence(self) -> int:
        """A number that grows with whatever the project comes to hold."""
        return self._journal.count

    @property
    def changes(self) -> tuple[Change, ...]:
        """All edits in order, those that are undone too."""
        return tuple(self._changes)

    def tell(self, address: str) -> None:
        """Note the address at which the project is open."""
        self._journal.tell(address)

    def subscribe(self, callback: Callable[[], None]) -> None:
        """Have a function called after each edit, undo, redo and finding."""
        self._subscribers.append(callback)

    @property
    def missing(self) -> list[str]:
        """Corpora, clips and files that the piece needs and that are not there, a line each."""
        return missing_in(self.state, self.movements.has, self.marks)

    def look_again(self, corpus: str) -> None:
        """Look at a corpus again that was made anew or deleted."""
        self.movements.forget(corpus)
        self.marks.forget()
        self._check_corpora(dict(self.versions))
        self.state = replace(self.state)  # for whoever looks at each state once
        self._changed()

    # --- findings ---------------------------------------------------------------------------------------------------

    def question(self, seam: Seam) -> str:
        """Return the question that a seam asks."""
        return question_of(seam.ends, seam.verdict.ask, self.corpus_at(seam), self.versions)

    def corpus_at(self, seam: Seam) -> str:
        """Return the name of the corpus that judges a seam: the piece's, or that of an insertion that is locked."""
        return seam.verdict.corpus or self.state.corpus

    def finding(self, seam: Seam) -> Finding | None:
        """Return what is known of a seam."""
        return self._findings.get(self.question(seam))

    def standing(self, seam: Seam) -> Found | None:
        """Return what was inserted at a seam before it was asked anew, to stand there until that is answered; None if
        nothing was, or it is discarded, or its sides are others now."""
        ends, found = self._stood.get(seam.pair, (None, None))
        return found if ends == seam.ends and seam.verdict.decision != "discarded" else None

    def lacks(self, seam: Seam) -> bool:
        """Return whether something is missing without which a seam can be neither judged nor smoothed."""
        ends = [(end.key, end.frame) for end in seam.ends]
        passed = [(one.posture, one.frame) for one in seam.verdict.ask.passing]
        return not (self.movements.has(self.corpus_at(seam)) and all(self.marks.has(*at) for at in ends + passed))

    def keep_finding(self, finding: Finding) -> None:
        """Keep what was found at a seam; MotionMindError if it cannot be written."""
        if self._findings.get(finding.finding) != finding:
            self._journal.append(finding)
            self._findings[finding.finding] = finding
            self._changed()

    # --- edits ------------------------------------------------------------------------------------------------------

    def edit(self, window: str, edit: Edit) -> None:
        """Apply an edit.

        Raises:
            RefusedError: it cannot be applied as things stand.
            MotionMindError: it cannot be written.
        """
        self.greet(window)
        try:
            check_names(edit)
            state = piece.apply(self.state, edit)
            check_movements(state, edit, self.marks.length)
        except MotionMindError as error:
            raise RefusedError(str(error)) from error
        self._note_versions(state)
        line = self._journal.append(EditLine(edit, self.sequence, window))
        asked: tuple[Seam, ...] = ()
        if isinstance(edit, Wish):
            asked = (self.state.seam(edit.left, edit.right),)
        elif isinstance(edit, SetCorpus):
            asked = self.state.seams
        for seam in asked:
            if found := chosen_at(seam, self.finding(seam)):
                self._stood[seam.pair] = seam.ends, found
        self._redoable.pop(window, None)
        self._add(Change(line.number, edit, window), state)
        self._changed()

    def undo(self, window: str) -> None:
        """Take back a window's last edit.

        Raises:
            RefusedError: there is none, or a later edit of another window rests on it.
            MotionMindError: it cannot be written.
        """
        self.greet(window)
        change = self._last(window)
        if change is None:
            raise RefusedError("this window has nothing to take back")
        state = self._without_conflict(change, undone=True)
        self._journal.append(UndoLine(change.number, self.sequence, window))
        self._switch(change, True, state)
        self._redoable.setdefault(window, []).append(change)
        self._changed()

    def redo(self, window: str) -> None:
        """Do again what a window took back last; errors as of `undo`."""
        self.greet(window)
        if not (stack := self._redoable.get(window)):
            raise RefusedError("this window has nothing to do again")
        change = stack[-1]
        state = self._without_conflict(change, undone=False)
        self._journal.append(RedoLine(change.number, self.sequence, window))
        self._switch(change, False, state)
        stack.pop()
        self._changed()

    def undoable(self, window: str) -> str | None:
        """Say what `undo` would take back; None if there is nothing."""
        change = self._last(window)
        return words_of(change.edit) if change else None

    def redoable(self, window: str) -> str | None:
        """Say what `redo` would do again; None if there is nothing."""
        stack = self._redoable.get(window)
        return words_of(stack[-1].edit) if stack else None

    def forget(self, window: str) -> bool:
        """Note that a window is gone for good: what it did, all others may take back; returns whether it was there."""
        was_there = window in self._windows
        self._windows.discard(window)
        return was_there

    def greet(self, window: str) -> None:
        """Note that a window is there: what it did, it alone takes back."""
        self._windows.add(window)

    def _last(self, window: str) -> Change | None:
        """The last change that a window may take back: its own, or one from before the project was opened."""
        mine = (one for one in reversed(self._changes) if not one.undone)
        return next((one for one in mine if one.window == window or one.window not in self._windows), None)

    def _without_conflict(self, change: Change, *, undone: bool) -> State:
        """Return the state with a change undone or redone; RefusedError if a later one rests on what it changes."""
        place = self._changes.index(change)
        later = [one for one in self._changes[place + 1 :] if not one.undone]
        places, words = touched(change.edit), words_of(change.edit)
        verb = "take back" if undone else "do again"
        for one in later:
            if places & touched(one.edit):
                raise RefusedError(f"cannot {verb} “{words}”: a later edit, “{words_of(one.edit)}”, rests on it")
        number = place // _EVERY
        state = self._states[number]
        for one in self._changes[number * _EVERY :]:
            if undone if one is change else one.undone:
                continue
            try:
                state = piece.apply(state, one.edit)
            except MotionMindError as error:
                why = f"“{words_of(one.edit)}” rests on it" if one is not change else str(error)
                raise RefusedError(f"cannot {verb} “{words}”: {why}") from error
        return state

    def _switch(self, change: Change, undone: bool, state: State) -> None:
        change.undone = undone
        del self._states[self._changes.index(change) // _EVERY + 1 :]
        self._remember(state)

    def _add(self, change: Change, state: State) -> None:
        self._changes.append(change)
        self._remember(state)

    def _remember(self, state: State) -> None:
        """Set the state, and remember it or those before it that are to be remembered."""
        self.state = state
        while len(self._states) * _EVERY <= len(self._changes):
            place, reached = len(self._states) * _EVERY, self._states[-1]
            for one in self._changes[place - _EVERY : place]:
                reached = reached if one.undone else piece.apply(reached, one.edit)
            self._states.append(reached)

    def _changed(self) -> None:
        for callback in self._subscribers:
            callback()

    # --- the file ---------------------------------------------------------------------------------------------------

    def _read(self) -> None:
        """Read all lines, and see whether everything is there that the state needs."""
        changes: dict[int, Change] = {}
        written: dict[str, str] = {}
        start = State()
        for line in self._journal.lines():
            try:
                record = decode_line(line.data)
            except (ValueError, RecursionError) as error:
                raise FormatError(f"is damaged: {error}", path=self.path, line=line.number + 1) from error
            match record:
                case Head():
                    start = State(title=record.title, corpus=record.corpus)
                    written |= record.corpora
                case Corpora():
                    written |= record.corpora
                case None:
                    self.movements.take_in(line)
                case Finding():
                    self._findings[record.finding] = record
                case EditLine():
                    changes[line.number] = Change(line.number, record.edit, record.window)
                    self._redoable.pop(record.window, None)
                case UndoLine(undo=number, window=window) | RedoLine(redo=number, window=window):
                    if (change := changes.get(number)) is None:
                        message = f"is damaged: there is no edit {number}"
                        raise FormatError(message, path=self.path, line=line.number + 1)
                    change.undone = isinstance(record, UndoLine)
                    stack = self._redoable.setdefault(window, [])
                    if change.undone:
                        stack.append(change)
                    elif change in stack:
                        stack.remove(change)
        self._changes = list(changes.values())
        self._apply_all(start)
        self._check_corpora(written)

    def _apply_all(self, state: State) -> None:
        self._states = [state]
        for place, one in enumerate(self._changes, start=1):
            try:
                state = state if one.undone else piece.apply(state, one.edit)
            except MotionMindError as error:
                raise FormatError(f"is damaged: {error}", path=self.path, line=one.number + 1) from error
            if place % _EVERY == 0:
                self._states.append(state)
        self.state = state

    def _check_corpora(self, written: Mapping[str, str]) -> None:
        """Compare the corpora that there are with those that the project was made with."""
        changed = []
        used = corpora_of(self.state) | {self.corpus_at(seam) for seam in self.state.seams}
        for name in sorted(used | set(written)):
            try:
                version = version_of(name, self._home)
            except MotionMindError:
                if name in used and name in written:  # what was found beside it stays found
                    self.versions[name] = written[name]
                continue
            if version != written.get(name, version):
                changed.append(name)
            self.versions[name] = version
        if changed:
            names = enumerated([displayed(name) for name in changed])
            self.words.append(f"{names} has changed since this piece was made: its seams are judged anew")
            self._journal.append(Corpora({name: self.versions[name] for name in changed}))

    def _note_versions(self, state: State) -> None:
        """Write down the versions of corpora that a state uses for the first time."""
        new = {name: version_of(name, self._home) for name in sorted(corpora_of(state) - self.versions.keys())}
        if new:
            self._journal.append(Corpora(new))
            self.versions |= new

    def _saved(self, name: str) -> str:
        return self.state.stable(f"{piece.OWN}{name}")
