"""An open project: its findings, its edits, and the state that they lead to."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Self

from motionmind.display import displayed
from motionmind.errors import MotionMindError, enumerated
from motionmind.studio import piece
from motionmind.studio.checks import check_bounds, check_movements, check_names, corpora_of, missing_in
from motionmind.studio.edit_words import words_of
from motionmind.studio.edits import Edit, Wish, touched
from motionmind.studio.findings import Finding, Found
from motionmind.studio.journal import DamagedError, Journal
from motionmind.studio.movements import Movements, version_of
from motionmind.studio.neighbours import OWN, End, Pair, Seam
from motionmind.studio.notes import COMMENTS
from motionmind.studio.placement import Marks
from motionmind.studio.questions import question_of
from motionmind.studio.records import Change, Corpora, EditLine, Head, RedoLine, UndoLine, decode_line
from motionmind.studio.settings import SetCorpus
from motionmind.studio.view import chosen_at

_log = logging.getLogger(__name__)

_N_CHANGES_PER_STATE = 16  # edits between remembered states, so that an undo need not replay all edits


class RefusedError(MotionMindError):
    """An edit cannot be applied to the present state; nothing has changed."""


class Project:
    """A project that is open in this process.

    Attributes:
        movements: all movements, by key.
        marks: marks of the movements.
        state: the state after its edits.
        versions: the version of each corpus that it uses.
        words: notices, such as that a corpus has changed.
    """

    def __init__(self, journal: Journal, home: Path | None = None) -> None:
        """Read a project's file; raise the errors of `open`."""
        self._journal, self._home = journal, home
        self.movements = Movements(journal, home)
        self.marks = Marks(self.movements.get, self.movements.facing)
        self.movements.saved = self._saved
        self.versions: dict[str, str] = {}
        self.words: list[str] = []
        self._changes: list[Change] = []
        self._redoable: dict[str, list[Change]] = {}  # by window; the last is redone first
        self._findings: dict[str, Finding] = {}
        self._stood: dict[Pair, tuple[tuple[End, End], Found]] = {}  # insertions from before a new request
        self._subscribers: list[Callable[[], None]] = []
        self._windows: set[str] = set()  # windows seen since the project was opened
        self._states: list[piece.State] = []  # before the first change, and after every `_N_CHANGES_PER_STATE` changes
        self.state = piece.State()
        if journal.dropped:
            self.words.append("the last edit was lost: the studio ended while writing it")
        written = self._read()
        journal.mend()
        journal.told = self.notice
        self._check_corpora(written)

    @classmethod
    def create(cls, path: Path, corpus: str, home: Path | None = None, title: str = "") -> Self:
        """Create a project with no edits.

        Args:
            path: its file, which must not exist.
            corpus: the corpus that judges and smooths.
            home: the folder of the user's corpora; None for the default folder.
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
            DamagedError: a line of the file is damaged.
            FormatError: it is not a project's file, or of another version.
            MotionMindError: it is open elsewhere.
        """
        journal = Journal.open(path)
        try:
            return cls(journal, home)
        except BaseException:
            journal.close()
            raise

    def close(self) -> None:
        """Close the file and release its lock."""
        self._journal.close()

    @property
    def path(self) -> Path:
        """The file."""
        return self._journal.path

    @property
    def saved(self) -> float:
        """The time at which the file was last written, in seconds since 1970."""
        return self._journal.saved

    @property
    def sequence(self) -> int:
        """A number that grows with each line of the file."""
        return self._journal.count

    @property
    def changes(self) -> tuple[Change, ...]:
        """All edits in order, with the undone ones."""
        return tuple(self._changes)

    def subscribe(self, callback: Callable[[], None]) -> None:
        """Call a function after each edit, undo, redo and finding."""
        self._subscribers.append(callback)

    def notice(self, words: str) -> None:
        """Show a notice on the terminal and in all windows."""
        if words not in self.words:
            self.words.append(words)
            _log.warning(words)
            self._changed()

    def withdraw(self, words: str) -> None:
        """Withdraw a notice, which no longer holds."""
        if words in self.words:
            self.words.remove(words)
            self._changed()

    @property
    def missing(self) -> list[str]:
        """Corpora and frames that the piece needs and lacks, a line each."""
        return missing_in(self.state, self.movements.has, self.marks)

    def look_again(self, corpus: str) -> None:
        """Reload a corpus that was rebuilt or deleted."""
        self.movements.forget(corpus)
        self.marks.forget()
        self._check_corpora(dict(self.versions))
        self.state = replace(self.state)  # a new object, which subscribers treat as a new state
        self._changed()

    # --- findings ---------------------------------------------------------------------------------------------------

    def question(self, seam: Seam) -> str:
        """Return the hash of a seam's question."""
        return question_of(seam.ends, seam.verdict.ask, self.corpus_at(seam), self.versions)

    def corpus_at(self, seam: Seam) -> str:
        """Return the name of the corpus that judges a seam: the locked insertion's, or else the piece's."""
        return seam.verdict.corpus or self.state.corpus

    def finding(self, seam: Seam) -> Finding | None:
        """Return the finding at a seam, if there is one."""
        return self._findings.get(self.question(seam))

    def standing(self, seam: Seam) -> Found | None:
        """Return the insertion from before a new request at a seam, which stays until the request is answered; None if
        there was none, it is discarded, or the seam's sides have changed."""
        ends, found = self._stood.get(seam.pair, (None, None))
        return found if ends == seam.ends and seam.verdict.decision != "discarded" else None

    def lacks(self, seam: Seam) -> bool:
        """Return whether a corpus or a frame is missing that is needed to judge and smooth a seam."""
        ends = [(end.key, end.frame) for end in seam.ends]
        passed = [(one.posture, one.frame) for one in seam.verdict.ask.passing]
        return not (self.movements.has(self.corpus_at(seam)) and all(self.marks.has(*at) for at in ends + passed))

    def keep_finding(self, finding: Finding) -> Finding:
        """Store a finding with the earlier insertions of its question, and return both as one.

        Raises:
            MotionMindError: it cannot be written.
        """
        earlier = self._findings.get(finding.finding)
        if (whole := finding.after(earlier)) != earlier:
            self._journal.append(whole)
            self._findings[finding.finding] = whole
            self._changed()
        return whole

    # --- edits ------------------------------------------------------------------------------------------------------

    def edit(self, window: str, edit: Edit) -> None:
        """Apply an edit.

        Raises:
            RefusedError: it cannot be applied to the present state.
            MotionMindError: it cannot be written.
        """
        self.greet(window)
        try:
            check_bounds(edit)
            check_names(edit)
            state = piece.apply(self.state, edit)
            check_movements(state, edit, self.marks.length)
        except MotionMindError as error:
            raise RefusedError(str(error)) from error
        self._note_versions(state)
        line = self._journal.append(EditLine(edit, self.sequence, window))
        asked = self.state.seams if isinstance(edit, SetCorpus) else ()
        if isinstance(edit, Wish):
            asked = (self.state.seam(edit.left, edit.right),)
        for seam in asked:
            if found := chosen_at(seam, self.finding(seam)):
                self._stood[seam.pair] = seam.ends, found
        self._redoable.pop(window, None)
        self._add(Change(line.number, edit, window), state)
        self._changed()

    def undo(self, window: str) -> None:
        """Undo a window's last edit.

        Raises:
            RefusedError: there is none, or a later edit of another window depends on it.
            MotionMindError: it cannot be written.
        """
        self.greet(window)
        change = self._last(window)
        if change is None:
            raise RefusedError("nothing to undo in this window")
        state = self._without_conflict(change, undone=True)
        self._journal.append(UndoLine(change.number, self.sequence, window))
        self._switch(change, True, state)
        self._redoable.setdefault(window, []).append(change)
        self._changed()

    def redo(self, window: str) -> None:
        """Redo the edit that a window undid last; raise the errors of `undo`."""
        self.greet(window)
        if not (stack := self._redoable.get(window)):
            raise RefusedError("nothing to redo in this window")
        change = stack[-1]
        state = self._without_conflict(change, undone=False)
        self._journal.append(RedoLine(change.number, self.sequence, window))
        self._switch(change, False, state)
        stack.pop()
        self._changed()

    def undoable(self, window: str) -> str | None:
        """Describe the edit that `undo` would undo; None if there is none."""
        change = self._last(window)
        return words_of(change.edit) if change else None

    def redoable(self, window: str) -> str | None:
        """Describe the edit that `redo` would redo; None if there is none."""
        stack = self._redoable.get(window)
        return words_of(stack[-1].edit) if stack else None

    def forget(self, window: str) -> bool:
        """Note that a window is gone, so that all others may undo its edits; return whether it was known."""
        was_there = window in self._windows
        self._windows.discard(window)
        return was_there

    def greet(self, window: str) -> None:
        """Note that a window is open, so that it alone may undo its edits."""
        self._windows.add(window)

    def _last(self, window: str) -> Change | None:
        """Return the last change that a window may undo: its own, or one of a window that is not open."""
        mine = (one for one in reversed(self._changes) if not one.undone and one.window != COMMENTS)
        return next((one for one in mine if one.window == window or one.window not in self._windows), None)

    def _without_conflict(self, change: Change, *, undone: bool) -> piece.State:
        """Return the state with a change undone or redone; raise RefusedError if a later one depends on it."""
        place = self._changes.index(change)
        later = [one for one in self._changes[place + 1 :] if not one.undone]
        places, words = touched(change.edit), words_of(change.edit)
        verb = "undo" if undone else "redo"
        for one in later:
            if places & touched(one.edit):
                raise RefusedError(f"cannot {verb} “{words}”: a later edit, “{words_of(one.edit)}”, depends on it")
        number = place // _N_CHANGES_PER_STATE
        state = self._states[number]
        for one in self._changes[number * _N_CHANGES_PER_STATE :]:
            if undone if one is change else one.undone:
                continue
            try:
                state = piece.apply(state, one.edit)
            except MotionMindError as error:
                why = f"“{words_of(one.edit)}” depends on it" if one is not change else str(error)
                raise RefusedError(f"cannot {verb} “{words}”: {why}") from error
        return state

    def _switch(self, change: Change, undone: bool, state: piece.State) -> None:
        change.undone = undone
        del self._states[self._changes.index(change) // _N_CHANGES_PER_STATE + 1 :]
        self._remember(state)

    def _add(self, change: Change, state: piece.State) -> None:
        self._changes.append(change)
        self._remember(state)

    def _remember(self, state: piece.State) -> None:
        """Set the state, and remember the states due after every `_N_CHANGES_PER_STATE` changes."""
        self.state = state
        while len(self._states) * _N_CHANGES_PER_STATE <= len(self._changes):
            place, reached = len(self._states) * _N_CHANGES_PER_STATE, self._states[-1]
            for one in self._changes[place - _N_CHANGES_PER_STATE : place]:
                reached = reached if one.undone else piece.apply(reached, one.edit)
            self._states.append(reached)

    def _changed(self) -> None:
        for callback in self._subscribers:
            callback()

    # --- the file ---------------------------------------------------------------------------------------------------

    def _read(self) -> dict[str, str]:
        """Read all lines, apply the edits, and return the corpora's versions on record."""
        changes: dict[int, Change] = {}
        written: dict[str, str] = {}
        start = piece.State()
        for line in self._journal.lines():
            try:
                record = decode_line(line.data)
            except (ValueError, RecursionError) as error:
                raise DamagedError(f"is damaged: {error}", self.path, line.number) from error
            match record:
                case Head():
                    start = piece.State(title=record.title, corpus=record.corpus)
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
                        raise DamagedError(f"is damaged: there is no edit {number}", self.path, line.number)
                    change.undone = isinstance(record, UndoLine)
                    stack = self._redoable.setdefault(window, [])
                    if change.undone:
                        stack.append(change)
                    elif change in stack:
                        stack.remove(change)
        self._changes = list(changes.values())
        self._apply_all(start)
        return written

    def _apply_all(self, state: piece.State) -> None:
        self._states = [state]
        for place, one in enumerate(self._changes, start=1):
            try:
                state = state if one.undone else piece.apply(state, one.edit)
            except MotionMindError as error:
                raise DamagedError(f"is damaged: {error}", self.path, one.number) from error
            if place % _N_CHANGES_PER_STATE == 0:
                self._states.append(state)
        self.state = state

    def _check_corpora(self, written: Mapping[str, str]) -> None:
        """Compare the existing corpora with the versions on record."""
        changed = []
        used = corpora_of(self.state) | {self.corpus_at(seam) for seam in self.state.seams}
        for name in sorted(used | set(written)):
            try:
                version = version_of(name, self._home)
            except MotionMindError:
                if name in used and name in written:  # its findings stay valid
                    self.versions[name] = written[name]
                continue
            if version != written.get(name, version):
                changed.append(name)
            self.versions[name] = version
        if changed:
            names = enumerated([displayed(name) for name in changed])
            self.words.append(f"{names} has changed since this piece was made: its seams will be checked again")
            self._journal.append(Corpora({name: self.versions[name] for name in changed}))

    def _note_versions(self, state: piece.State) -> None:
        """Record the versions of corpora that a state uses for the first time."""
        new = {name: version_of(name, self._home) for name in sorted(corpora_of(state) - self.versions.keys())}
        if new:
            self._journal.append(Corpora(new))
            self.versions |= new

    def _saved(self, name: str) -> str:
        return self.state.stable(f"{OWN}{name}")
