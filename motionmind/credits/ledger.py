"""The ledger of a movement: its credits added up by clip, performer, corpus and licence, and as text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from motionmind.credits.credit import Credit
from motionmind.credits.licences import find_conflicts, find_licence
from motionmind.display import displayed
from motionmind.errors import FormatError
from motionmind.files import FilePath, read_bytes

ENGINE = "the engine"  # made the movement that no clip attests
GIVEN = "given"
UNSTATED = "not stated"
_MAX_TEXT_LENGTH = 300  # characters of a title or a source


class Ledger(msgspec.Struct, frozen=True):
    """The credits of a movement, and their sums.

    Attributes:
        clips: a credit for each clip, the largest first.
        performers: the share of each performer.
        corpora: the share of each corpus.
        licences: the share under each licence, as the corpora state them.
        notes: reasons against passing the movement on, in sentences.
    """

    clips: list[Credit] = []
    performers: dict[str, float] = {}
    corpora: dict[str, float] = {}
    licences: dict[str, float] = {}
    notes: list[str] = []


def ledger_of(parts: Sequence[Credit]) -> Ledger:
    """Return the ledger of a movement's credits, with separate sums for given movement and for the engine's own."""
    return Ledger(
        list(parts),
        _sums(parts, lambda one: one.performer),
        _sums(parts, lambda one: one.corpus),
        _sums(parts, lambda one: one.licence),
        objections(parts),
    )


class _Report(msgspec.Struct):
    """The report of a tween or a variation, or a movement, which has a format."""

    format: str | None = None
    credits: Ledger | None = None


def read_ledger(path: FilePath) -> Ledger | None:
    """Read the ledger in a report; return None for any other file.

    Raises:
        FormatError: the report has no ledger, or a damaged one.
    """
    if Path(path).suffix.lower() != ".json":
        return None
    try:
        report = msgspec.json.decode(read_bytes(path), type=_Report)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FormatError(f"is neither movement nor a report: {error}", path=path) from error
    if report.format is not None:
        return None
    if report.credits is None:
        again = "make a report of an earlier version again: motionmind tween (or vary) ... --report FILE"
        raise FormatError(f"neither movement nor a report with credits; {again}", path=path)
    return report.credits


def objections(parts: Sequence[Credit]) -> list[str]:
    """List the reasons against passing on a movement with these credits: see `find_conflicts`."""
    return find_conflicts({displayed(one.corpus): displayed(one.licence) for one in parts if one.corpus})


def _sums(parts: Sequence[Credit], name_of: Callable[[Credit], str]) -> dict[str, float]:
    """Add up shares by name, the largest first."""
    sums: dict[str, float] = {}
    for one in parts:
        name = ENGINE if one.is_engines else GIVEN if one.is_given else name_of(one) or UNSTATED
        sums[name] = sums.get(name, 0.0) + one.share
    return dict(sorted(sums.items(), key=lambda entry: (-round(entry[1], 9), entry[0])))


def sections_of(ledger: Ledger) -> dict[str, list[str]]:
    """Write a ledger as lines of text under headings; none for a movement without credits."""
    if not ledger.clips:
        return {}
    about = {one.corpus: one for one in ledger.clips}
    sections = {
        "performers": [
            f"{_percent(share)}  {displayed(name, _MAX_TEXT_LENGTH)}" for name, share in ledger.performers.items()
        ],
        "licences": [f"{_percent(share)}  {_terms(name)}" for name, share in ledger.licences.items()],
        "corpora": [f"{_percent(share)}  {_attribution(name, about)}" for name, share in ledger.corpora.items()],
        "clips": [f"{_percent(one.share)}  {_clip(one)}" for one in ledger.clips],
    }
    return ({"beware": ledger.notes} if ledger.notes else {}) | sections


def lines_of(ledger: Ledger) -> Iterator[str]:
    """Write a ledger as lines of text; none for a movement without credits."""
    for heading, lines in sections_of(ledger).items():
        yield heading
        yield from (f"  {line}" for line in lines)


def _percent(share: float) -> str:
    """Format a share in four characters: " 62%", "<.5%" if it rounds to zero."""
    return f"{share:4.0%}" if share >= 0.005 else "<.5%"


def _terms(licence: str) -> str:
    """Return a licence with its terms."""
    if licence in (ENGINE, GIVEN):
        return licence
    asks = find_licence("" if licence == UNSTATED else licence).terms
    return f"{displayed(licence, _MAX_TEXT_LENGTH)}: {asks}"


def _attribution(name: str, about: Mapping[str, Credit]) -> str:
    """Return a corpus with its title, author, source and licence, which its licence may require."""
    one = about.get(name, Credit(0.0))
    facts = [displayed(text, _MAX_TEXT_LENGTH) for text in (one.title, one.author, one.source, one.licence) if text]
    return displayed(name) + (f": {'; '.join(facts)}" if facts else "")


def _clip(credit: Credit) -> str:
    """Format a clip by its corpus, name and performer."""
    if credit.is_engines:
        return f"{ENGINE}: no clip attests it"
    if credit.is_given:
        return f"{displayed(credit.clip)}, which was given"
    by = f", {displayed(credit.performer)}" if credit.performer else ""
    return f"{displayed(credit.corpus)}: {displayed(credit.clip)}{by}"
