"""Damages the bytes of files at random: a law of none of the formats."""

from __future__ import annotations

import io
import random
import zipfile
from collections.abc import Sequence

# What parsers stumble over: numbers at limits and beyond, names that mean something, ends, signs, other scripts.
TOKENS = [
    *(b"nan", b"NaN", b"inf", b"-inf", b"1e999", b"1e300", b"-1e308", b"1e-320", b"1e6", b"-1", b"0", b"-0.0", b"1_0"),
    *(b"9" * 30, b"9" * 5000, b"2147483648", b"-2147483649", b"18446744073709551616", b"0x10", b"1e", b".", b"-", b"+"),
    *(b"{", b"}", b"[", b"]", b"(", b")", b'"', b"'", b"\\", b"/", b"|", b"=", b",", b":", b";", b"#", b"%s", b"{}"),
    *(b"null", b"true", b"{}", b"[]", b'""', b"[" * 500, b'{"a":' * 200, b"\n", b"\r", b"\t", b"\0", b"\x1b]0;x\x07"),
    *("\u202e \u2028 \x85 \u0661 é \ufeff".encode().split(b" ")),
    *(b"\xff\xfe", b"\xed\xa0\x80", b"\xc3"),
    *(b"End", b"Site", b"MOTION", b"Frames: 1", b"include", b"backwards", b"1000 times", b"..", b"/dev/null", b"~"),
]


def damaged(data: bytes, others: Sequence[bytes], rng: random.Random) -> bytes:
    """Damage bytes in one place, or in a few."""
    out = bytearray(data)
    for _ in range(rng.choice([1, 1, 1, 1, 2, 4])):
        at = rng.randrange(len(out) + 1)
        long = rng.choice([1, 1, 2, 4, 16, 64, 256])
        match rng.randrange(10):
            case 0:
                del out[at : at + long]
            case 1 if at < len(out):
                out[at] ^= 1 << rng.randrange(8)
            case 2:
                out[at:at] = out[at : at + long]
            case 3:
                out[at : at + rng.choice([0, 1, long])] = rng.choice(TOKENS)
            case 4:
                out[at : at + long] = rng.randbytes(rng.randint(0, 4))
            case 5:
                other = rng.choice(others)
                there = rng.randrange(len(other) + 1)
                out[at : at + rng.choice([0, long])] = other[there : there + long]
            case 6 if rng.random() < 0.3:
                del out[at:]
            case _:
                out = bytearray(_in_words(bytes(out), rng))
    return bytes(out)


def _in_words(data: bytes, rng: random.Random) -> bytes:
    """Delete, double, exchange or replace lines or words."""
    mark = rng.choice([b"\n", b" ", b",", b"\n"])
    parts = data.split(mark)
    at, other = rng.randrange(len(parts)), rng.randrange(len(parts))
    match rng.randrange(5):
        case 0:
            del parts[at]
        case 1:
            parts.insert(at, parts[other])
        case 2:
            parts[at], parts[other] = parts[other], parts[at]
        case 3:
            parts[at] = rng.choice(TOKENS)
        case 4:
            parts[at:at] = [parts[other]] * rng.choice([2, 30, 300])
    return mark.join(parts)[: 1 << 18]


def damaged_archive(data: bytes, others: Sequence[bytes], rng: random.Random) -> bytes:
    """Damage an archive's bytes, or one of the files in it, so that its checksum is right."""
    if rng.random() < 0.3:
        return damaged(data, others, rng)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(out, "w") as made:
        names = archive.namelist()
        chosen = rng.choice(names)
        for name in names:
            inner = archive.read(name)
            dated_1980 = zipfile.ZipInfo(name)  # and not as late as it is, which would be other bytes each time
            kind = rng.choice([archive.getinfo(name).compress_type] * 3 + [zipfile.ZIP_DEFLATED])
            made.writestr(dated_1980, damaged(inner, [inner], rng) if name == chosen else inner, kind)
    return out.getvalue()
