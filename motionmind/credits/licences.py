"""Common licences of movement: their terms for derived work, and conflicts between them.

The table shows trouble early; it is not legal advice. Names are SPDX identifiers, with any version. Compatibility
follows Creative Commons' chart: Creative Commons, "Frequently asked questions" (2025), section "Can I combine material
under different Creative Commons licenses in my work?".
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations


@dataclass(frozen=True)
class Licence:
    """The terms of a licence.

    Attributes:
        name: its SPDX identifier without a version; "" for an unknown licence.
        terms: in words.
        allows_derivatives: whether derived work may be passed on.
        allows_commerce: whether derived work may be sold.
        is_share_alike: whether derived work must have the same licence.
        is_open: whether use beyond research is allowed.
    """

    name: str
    terms: str
    allows_derivatives: bool = True
    allows_commerce: bool = True
    is_share_alike: bool = False
    is_open: bool = True


UNKNOWN = Licence("", "not known here: ask who made the movement")
RESEARCH = Licence("LicenseRef-research-only", "for research alone", allows_commerce=False, is_open=False)
_BY = "name the authors"
_NC = "do not sell it"
_SA = "pass on what you make under the same licence"
_ND = "do not pass on what you make of it"
KNOWN = {
    licence.name: licence
    for licence in (
        Licence("CC0", "do as you like"),
        Licence("MIT", "keep the copyright notice and the licence"),
        Licence("CC-BY", _BY),
        Licence("CC-BY-SA", f"{_BY}; {_SA}", is_share_alike=True),
        Licence("CC-BY-NC", f"{_BY}; {_NC}", allows_commerce=False),
        Licence("CC-BY-NC-SA", f"{_BY}; {_NC}; {_SA}", allows_commerce=False, is_share_alike=True),
        Licence("CC-BY-ND", f"{_BY}; {_ND}", allows_derivatives=False),
        Licence(
            "CC-BY-NC-ND",
            f"{_BY}; {_NC}; {_ND}",
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
    """Return the licence named in a text such as "CC BY-NC 4.0" or "cc-by-nc-4.0"; `UNKNOWN` if there is none.

    A text that joins several licences counts as unknown.
    """
    plain = re.sub(r"[\s_]+", "-", text[:300].strip().upper())
    if _COMBINED.search(plain):
        return UNKNOWN
    if found := _CREATIVE_COMMONS.search(plain):
        free, sold, more = found.groups()
        return KNOWN["CC0" if free else f"CC-BY{sold or ''}{f'-{more}' if more else ''}"]
    if re.fullmatch(r"(THE-)?MIT(-LICEN[CS]E)?", plain):
        return KNOWN["MIT"]
    return RESEARCH if _RESEARCH.search(plain) else UNKNOWN


def find_conflicts(licences: Mapping[str, str]) -> list[str]:
    """List the reasons against passing on a work derived from several corpora.

    Args:
        licences: {corpus: the licence that it states}.

    Returns:
        A sentence for each corpus that forbids derivatives, then for each pair of licences that cannot be combined.
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
    """Return why a share-alike licence excludes a part under another licence; "" if it does not."""
    if not strict.is_share_alike:
        return ""
    wants = f"{strict.name} wants the whole under {strict.name}"
    if not loose.is_open:
        return f"{wants}, for any use, and {loose.name} allows research alone"
    if strict.allows_commerce and not loose.allows_commerce:
        return f"{wants}, which may be sold, and {loose.name} forbids that"
    return ""
