"""Common licences of movement: what they ask of work that is made of it, and which of them cannot be combined.

The table is a help to see trouble early, and no legal advice. Names are SPDX identifiers, with any version. What can be
combined follows Creative Commons' chart: Creative Commons, "Frequently asked questions" (2025), section "Can I combine
material under different Creative Commons licenses in my work?".
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

_LONGEST = 300  # characters of a licence in which its name is looked for


@dataclass(frozen=True)
class Licence:
    """The terms of a licence.

    Attributes:
        name: its SPDX identifier without a version; "" if the licence is not known.
        terms: what it asks, in words.
        allows_derivatives: whether what is made of the work may be passed on.
        allows_commerce: whether that may be sold.
        is_share_alike: whether it has to be under the same licence.
        is_open: whether it may be used beyond research.
    """

    name: str
    terms: str
    allows_derivatives: bool = True
    allows_commerce: bool = True
    is_share_alike: bool = False
    is_open: bool = True


UNKNOWN = Licence("", "not known here: ask who made the movement")
RESEARCH = Licence("LicenseRef-research-only", "for research alone", allows_commerce=False, is_open=False)
_NAMED = "name the authors"
_NOT_SOLD = "do not sell it"
_ALIKE = "pass on what you make under the same licence"
_NO_DERIVATIVES = "do not pass on what you make of it"
KNOWN = {
    licence.name: licence
    for licence in (
        Licence("CC0", "do as you like"),
        Licence("MIT", "keep the copyright notice and the licence"),
        Licence("CC-BY", _NAMED),
        Licence("CC-BY-SA", f"{_NAMED}; {_ALIKE}", is_share_alike=True),
        Licence("CC-BY-NC", f"{_NAMED}; {_NOT_SOLD}", allows_commerce=False),
        Licence("CC-BY-NC-SA", f"{_NAMED}; {_NOT_SOLD}; {_ALIKE}", allows_commerce=False, is_share_alike=True),
        Licence("CC-BY-ND", f"{_NAMED}; {_NO_DERIVATIVES}", allows_derivatives=False),
        Licence(
            "CC-BY-NC-ND",
            f"{_NAMED}; {_NOT_SOLD}; {_NO_DERIVATIVES}",
            allows_derivatives=False,
            allows_commerce=False,
        ),
        RESEARCH,
    )
}
_CREATIVE_COMMONS = re.compile(r"\bCC-?(?:(0|ZERO)|BY(-NC)?(?:-(SA|ND))?)(?=-|\b)")
_RESEARCH = re.compile(
    r"\bRESEARCH(-USE)?-ONLY|(ONLY|ALONE)-FOR-RESEARCH|FOR-RESEARCH-(PURPOSES-)?(ONLY|ALONE)|NON-?COMMERCIAL-RESEARCH"
)
_COMBINED = re.compile(r"-(AND|OR|WITH)-CC|-(AND|OR|WITH)-(MIT|LICENSEREF)")


def find_licence(text: str) -> Licence:
    """Return the licence that a text names, as "CC BY-NC 4.0" and "cc-by-nc-4.0" do; `UNKNOWN` if it names none.

    A text that joins several licences is not known.
    """
    plain = re.sub(r"[\s_]+", "-", text[:_LONGEST].strip().upper())
    if _COMBINED.search(plain):
        return UNKNOWN
    if found := _CREATIVE_COMMONS.search(plain):
        free, sold, more = found.groups()
        return KNOWN["CC0" if free else f"CC-BY{sold or ''}{f'-{more}' if more else ''}"]
    if re.fullmatch(r"(THE-)?MIT(-LICEN[CS]E)?", plain):
        return KNOWN["MIT"]
    return RESEARCH if _RESEARCH.search(plain) else UNKNOWN


def find_conflicts(licences: Mapping[str, str]) -> list[str]:
    """Say what stands against passing on a work that is made of several corpora.

    Args:
        licences: the licence of each corpus, as it states it.

    Returns:
        A sentence for each corpus that forbids derivatives, then for each two licences that cannot be combined.
    """
    found = [
        f"{corpus} forbids derivatives ({licence}): do not pass on what is made of it, unless its authors allow it"
        for corpus, licence in licences.items()
        if not find_licence(licence).allows_derivatives
    ]
    by_name: dict[str, list[str]] = {}
    for corpus, licence in licences.items():
        if (known := find_licence(licence)).allows_derivatives and known is not UNKNOWN:
            by_name.setdefault(known.name, []).append(corpus)
    for (one, ones), (other, others) in combinations(by_name.items(), 2):
        for strict, loose in ((one, other), (other, one)):
            if reason := _objection(KNOWN[strict], KNOWN[loose]):
                corpora = f"{', '.join(ones)} ({one}) and {', '.join(others)} ({other})"
                found.append(f"{corpora} cannot be combined: {reason}")
                break
    return found


def _objection(strict: Licence, loose: Licence) -> str:
    """Return why a work cannot be under a share-alike licence where a part is under another; "" if it can."""
    if not strict.is_share_alike:
        return ""
    wants = f"{strict.name} wants the whole under {strict.name}"
    if not loose.is_open:
        return f"{wants}, for any use, and {loose.name} allows research alone"
    if strict.allows_commerce and not loose.allows_commerce:
        return f"{wants}, which may be sold, and {loose.name} forbids that"
    return ""
