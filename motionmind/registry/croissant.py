"""Describe a published corpus in Croissant 1.0, the metadata format by which search engines and tools find data sets.

"Croissant Format Specification", version 1.0, MLCommons (2024) [Croissant24]. JSON-LD with the schema.org vocabulary.
"""

from __future__ import annotations

from typing import Any
from urllib.parse import urljoin

from motionmind.registry.index import Archive, Entry, File

# From the specification's first appendix, with the prefixes that its terms use.
_CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
_FORMS = {".json": "application/json", ".txt": "text/plain", ".npy": "application/x-npy"}


def describe(entry: Entry, url: str, date: str, licence_url: str | None) -> dict[str, Any]:
    """Describe a corpus as a Croissant data set, ready for JSON.

    Args:
        entry: the corpus.
        url: the address of the published folder.
        date: the day of publication, as "2026-11-23".
        licence_url: the address of the licence; None if there is none.
    """
    creators = dict.fromkeys([entry.author, *entry.performers])
    described = {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": entry.name,
        "description": f"{entry.title}. Movement to learn from: {entry.clips} clips, {entry.postures} postures. "
        f"Source: {entry.source}",
        "license": licence_url or {"@type": "sc:CreativeWork", "name": entry.licence, "text": entry.licence_text},
        "url": url,
        "creator": [{"@type": "sc:Person", "name": name} for name in creators],
        "datePublished": date,
        "version": "1.0.0",
        "keywords": ["motion capture", "human movement", "in-betweening"],
        "isLiveDataset": False,
        "distribution": [_archive(entry.archive, url), *(_member(file, entry.archive) for file in entry.files)],
    }
    return described | ({"citeAs": entry.citation} if entry.citation else {})


def _archive(archive: Archive, url: str) -> dict[str, Any]:
    """Describe the archive that contains the files."""
    return {
        "@type": "cr:FileObject",
        "@id": archive.url,
        "name": archive.url,
        "contentUrl": urljoin(url, archive.url),
        "contentSize": f"{archive.size} B",
        "encodingFormat": "application/x-tar",
        "sha256": archive.sha256,
    }


def _member(file: File, archive: Archive) -> dict[str, Any]:
    """Describe a file in the archive."""
    return {
        "@type": "cr:FileObject",
        "@id": file.name,
        "name": file.name,
        "containedIn": {"@id": archive.url},
        "contentUrl": file.name,
        "contentSize": f"{file.size} B",
        "encodingFormat": _FORMS[file.name[file.name.rindex(".") :]],
        "sha256": file.sha256,
    }
