"""Generates files that are well formed and mean much: shared values, odd types, huge counts.

Damage to bytes hardly ever makes these, since many bytes have to agree. Each generator takes the whole files of a
reader and a random number generator.
"""

from __future__ import annotations

import codecs
import io
import json
import math
import pickle
import random
import struct
import zipfile
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

Generate = Callable[[Sequence[bytes], random.Random], bytes]

MAX_BYTES = 1_000_000  # of a generated file, for which a reader may take 10 s and 1 GB

SIZES = [0, 1, 1, 2, 2, 3, 4, 7, 24, 72, 1000, -1, 2**31 - 1, 2**31, 2**40, 2**62, 2**63, 2**64, 10**30]
TEXTS = ["", "a", "hips", "left_hip", "../a", "/", "a\nb", "\x1b[31m", "\ud800", "é" * 300, "a" * 70_000, "9" * 5000]
NUMBERS = [0, 1, -1, 0.5, -0.0, 1e-320, 1e9, 1e300, math.inf, -math.inf, math.nan, 10**400, True, False]


def _odd(rng: random.Random) -> Any:
    """A plain value that hardly any place in a file should have."""
    return rng.choice([rng.choice(SIZES), rng.choice(TEXTS), rng.choice(NUMBERS), None])


# --- pickles --------------------------------------------------------------------------------------------------------


class Call:
    """A value that pickle writes as a call of a function, with a state."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...], state: Any = None) -> None:
        self.call = (function, arguments) if state is None else (function, arguments, state)

    def __reduce__(self) -> tuple[Any, ...]:
        return self.call


FUNCTIONS = [np.dtype, np.ndarray, codecs.encode, np.float32(1).__reduce__()[0], np.zeros(1).__reduce__()[0]]
TYPES = ["f8", "f4", "i8", "u1", "O", "U9", "V999", "f8,f8", "(9,9)f8", "M8[s]", "", "x"]
# Instructions that a program may have in any order; h\0 and 2 mention a value again.
INSTRUCTIONS = [
    *(b"(", b"0", b"1", b"2", b"]", b"}", b")", b"l", b"d", b"t", b"\x85", b"\x86", b"\x87", b"a", b"e", b"s", b"u"),
    *(b"N", b"I1\n", b"F1e3\n", b"K\x05", b"L0xffffffffffffffffffffffL\n", b"\x8a\xff" + b"\xff" * 255, b"\x88"),
    *(b"q\0", b"h\0", b"h\0", b"q\1", b"h\1", b"h\1", b"p2\n", b"g2\n", b"\x94", b"R", b"b", b"\x93", b"\x81", b"c"),
    *(b"X\4\0\0\0abcd", b"U\2f8", b"C\x08" + bytes(8), b"cnumpy\ndtype\n", b"cnumpy\nndarray\n", b"c_codecs\nencode\n"),
    *(b"cnumpy.core.multiarray\n_reconstruct\n", b"cnumpy.core.multiarray\nscalar\n", b"X\xff\xff\xff\xff", b"."),
    *(b"cnumpy.core.numeric\n_frombuffer\n", b"\x95" + b"\xff" * 8, b"B\xff\xff\xff\xff", b"T\4\0\0\0abcd", b"S'a'\n"),
]


def pickles(_: Sequence[bytes], rng: random.Random) -> bytes:
    """Movement with odd arrays, whose parts are the same values in many places; or a program of any instructions."""
    if rng.random() < 0.1:
        nest = b"F1\n" + b"".join(b"p%d\n0(" % i + b"g%d\n" % i * 10 + rng.choice([b"t", b"l"]) for i in range(12))
        return rng.choice([b"}%sNs.", b"}S'smpl_poses'\n%ss.", b"(%sNd.", b"cnumpy\ndtype\n(%stR."]) % nest
    if rng.random() < 0.3:
        steps = [rng.choice(INSTRUCTIONS) for _ in range(rng.choice([3, 10, 40]))]
        program = b"".join(step * rng.choice([1, 1, 1, 1, 2, 9, 900]) for step in steps)
        return (
            b"\x80\x02" + rng.choice([b"", b"}", b"(", b"}X\x0a\0\0\0smpl_poses"]) + program + rng.choice([b".", b"s."])
        )
    known: list[Any] = []
    held: Any = {name: _value(rng, known, 0) for name in ("smpl_poses", "smpl_trans", "smpl_scaling")}
    if rng.random() < 0.3:
        held[_key(rng)] = _value(rng, known, 0)
    dump = rng.choice([pickle.dumps, pickle._dumps])
    try:
        return bytes(dump(held, rng.randrange(6)))[:MAX_BYTES]
    except Exception:  # not every protocol writes every value
        return pickles(_, rng)


def _value(rng: random.Random, known: list[Any], depth: int) -> Any:
    """A value of a pickle, which may hold those before it."""
    match rng.randrange(10 if depth < 4 else 4):
        case 0:
            found: Any = _odd(rng)
        case 1:
            plain = [one for one in known if not isinstance(one, (list, tuple, dict))]
            found = rng.choice(rng.choice([known, plain, plain, plain]) or [1.0])
        case 2:
            shape = [rng.choice([0, 1, 3, 4, 72]) for _ in range(rng.randrange(4))]
            found = np.ones(shape, rng.choice(["f8", ">f4", "u1", "i2", "?", "U3", "O", "c16"]))
        case 3:
            found = rng.choice([rng.randbytes(5), b"a" * 70_000, "8" * 200_000])
        case 4:
            arguments = tuple(_value(rng, known, depth + 1) for _ in range(rng.choice([0, 1, 2, 3, 4])))
            state = rng.choice([None, _value(rng, known, depth + 1)])
            found = Call(rng.choice(FUNCTIONS), arguments, state)
        case 5:
            kind, size = (
                Call(np.dtype, (rng.choice(TYPES), False, True), (3, rng.choice("<>|"))),
                rng.choice([0, 8, 576]),
            )
            shape = tuple(rng.choice(SIZES) for _ in range(rng.choice([0, 1, 2, 3, 90])))
            found = Call(FUNCTIONS[-1], (np.ndarray, (0,), b"b"), (1, shape, kind, bool(size), bytes(size)))
        case 6:
            found = _value(rng, known, depth + 1)
            for _ in range(rng.choice([0, 0, 0, 1, 3, 12])):
                found = rng.choice([list, tuple, lambda rows: dict(zip("abcdefghij", rows, strict=True))])([found] * 10)
        case 7:
            found = {_key(rng): _value(rng, known, depth + 1) for _ in range(rng.randrange(4))}
        case _:
            rows = [_value(rng, known, depth + 1) for _ in range(rng.randrange(5))]
            found = rng.choice([list, tuple])(rows * rng.choice([1, 1, 3, 300]))
            if isinstance(found, list) and rng.random() < 0.1:
                found.append(found)
    known.append(found)
    return found


def _key(rng: random.Random) -> Any:
    return rng.choice([*TEXTS[:5], *TEXTS[:5], rng.choice(SIZES), (1, (2.0,)), b"a", None])


# --- numpy's arrays -------------------------------------------------------------------------------------------------


def arrays(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """An array with a header of odd types and sizes, or a long one."""
    sides = [
        *map(repr, SIZES),
        "True",
        "1.0",
        "'3'",
        "None",
        "(2,)",
        "3L",
        "1e3",
        "9" * 5000,
        "a",
        *("4", "159", "315") * 3,
    ]
    types = [repr(one) for one in (*TYPES, "<f8", "<f8", ">f4", "|u1", "<q9")] + [
        "[('a', '<f8')]",
        "8",
        "None",
        "'a\\nb'",
    ]
    shape = ", ".join(rng.choice(sides) for _ in range(rng.choice([0, 1, 2, 2, 2, 3, 40])))
    entries = [
        f"'descr': {rng.choice(types)}",
        f"'fortran_order': {rng.choice(['False', 'True', '2', 'None'])}",
        f"'shape': {rng.choice(['({},)', '({},)', '[{}]', '{}']).format(shape)}",
    ]
    rng.shuffle(entries)
    header = "{" + ", ".join(entries[: rng.choice([2, 3, 3, 3])]) + rng.choice([", }", "}", "", " " * 20_000])
    header += rng.choice(["", "\n", "(" * 9000, "\\", "\0", "#"])
    version = rng.choice([1, 1, 2, 3, 4])
    length = rng.choice([len(header)] * 4 + [0, 65_535, 2**32 - 1]) % (2**16 if version == 1 else 2**32)
    head = struct.pack("<H" if version == 1 else "<I", length)
    data = rng.choice(seeds)[-rng.choice([0, 8, 1000, 10**6]) :]
    return b"\x93NUMPY" + bytes([version, 0]) + head + header.encode() + data


def archives_of_arrays(_: Sequence[bytes], rng: random.Random) -> bytes:
    """An archive of arrays that unpack to much, some of them odd."""
    out, frames = io.BytesIO(), rng.choice([1, 3, 3, 3, 1000, 1000, 1000, 40_000, 130_000])
    names = ["poses", "trans", "mocap_framerate", "fps", "body_pose", "root_orient", "transl", "pose_hand", "fullpose"]
    with zipfile.ZipFile(out, "w") as archive:
        for name in rng.choice([names[:3], names[:3], names[:3], names[3:7], rng.sample(names, 9)]):
            width = {"poses": 66, "fullpose": 165, "body_pose": 63, "pose_hand": 90}.get(name, 3)
            whole = io.BytesIO()
            sizes = () if name in ("fps", "mocap_framerate") else (frames, width)
            np.save(whole, np.ones(sizes, rng.choice(["u1", "f4", "f8"] if frames < 2000 else ["u1"])))
            data = arrays([bytes(1000)], rng) if rng.random() < 0.05 else whole.getvalue()
            kind = rng.choice([*[zipfile.ZIP_DEFLATED] * 30, zipfile.ZIP_STORED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
            kind = zipfile.ZIP_DEFLATED if len(data) > MAX_BYTES // 9 else kind
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), data, kind)
    return out.getvalue()


# --- JSON -----------------------------------------------------------------------------------------------------------


def documents(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """JSON with odd values in some places, entries that are missing, doubled or moved, and names of any kind."""
    document = json.loads(rng.choice(seeds))
    for _ in range(rng.choice([1, 1, 1, 2, 5])):
        holder = document
        while True:  # down to a random place
            keys = list(holder) if isinstance(holder, dict) else range(len(holder))
            if not keys:
                break
            key = rng.choice(keys)
            if isinstance(holder[key], (dict, list)) and rng.random() < 0.8:
                holder = holder[key]
                continue
            match rng.randrange(8):
                case 0:
                    del holder[key]
                case 1 if isinstance(holder, dict):
                    holder[rng.choice(TEXTS)] = holder.pop(key)
                case 2:
                    holder[key] = [holder[key]] * rng.choice([0, 1, 2, 1000])
                case 3:
                    other = rng.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
                    holder[key] = holder[other]
                case 4:
                    holder[key] = rng.choice([{}, [], [[]], {"a": {"b": [1]}}, [_odd(rng)] * 10_000])
                case 5 if isinstance(holder, list):
                    holder *= rng.choice([2, 30])
                case _:
                    holder[key] = _odd(rng)
            break
    return _encoded(document)


def _encoded(document: Any) -> bytes:
    """JSON, with the numbers that Python writes and JSON lacks; lone surrogates stay escaped."""
    text, size = [], 0
    for piece in json.JSONEncoder().iterencode(document):  # what is doubled often enough would fill the memory
        text.append(piece)
        size += len(piece)
        if size > MAX_BYTES:
            break
    return "".join(text).encode()[:MAX_BYTES]


# --- tar ------------------------------------------------------------------------------------------------------------


def tars(seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """A whole archive with headers in front of a random one: extended, of long names, of links, sparse, or huge."""
    whole = rng.choice(seeds)
    starts = [at for at in range(0, len(whole), 512) if whole[at + 257 : at + 262] == b"ustar"]
    out, at = [], 0
    for start in sorted(rng.sample(starts, min(len(starts), rng.choice([1, 1, 2])))):
        out.append(whole[at:start])
        out += [_tar_entry(rng, whole[start : start + 512]) for _ in range(rng.choice([1, 1, 2, 50]))]
        at = start + 512 * rng.choice([0, 0, 0, 1])
    return b"".join([*out, whole[at:]])[:MAX_BYTES]


def _tar_entry(rng: random.Random, header: bytes) -> bytes:
    """A header with a right checksum, and its data."""
    kind = rng.choice(b"xxxgLKS1234567\0A")
    texts = [b"a" * rng.choice([1, 100, 100_000]), b"9" * 100_000, b"", b"manifest.json\0"]
    data = rng.choice([_pax_records(rng), *texts])
    size = rng.choice([len(data)] * 8 + SIZES)
    octal = b"%011o\0" % size if 0 <= size < 8**11 else b"\x80" + (size % 2**88).to_bytes(11, "big")
    name = rng.choice([header[:100], header[:100], b"././@PaxHeader", b"a" * 100, b"../a", b"1/"]).ljust(100, b"\0")
    block = bytearray(name + header[100:124] + octal + header[136:148] + b" " * 8 + bytes([kind]) + header[157:512])
    if kind == ord("S"):  # a map of a sparse file, whether there is more of it, and its real size
        parts = b"".join(b"%011o\0" % rng.choice([0, 1, 512, 8**11 - 1]) for _ in range(8))
        block[386:495] = parts + rng.choice([b"\0", b"\1"]) + b"%011o\0" % 8**10
    block[148:156] = b"%06o\0 " % (sum(block) if rng.random() < 0.95 else 0)
    return bytes(block) + data + bytes(-len(data) % 512)


def _pax_records(rng: random.Random) -> bytes:
    """Records of an extended header, most of them of the right length."""
    keys = [*("path", "size", "linkpath", "mtime", "hdrcharset"), *("GNU.sparse.map", "GNU.sparse.size")]
    out = b""
    for _ in range(rng.choice([1, 1, 2, 2, 900])):
        value = rng.choice([str(rng.choice(SIZES)), rng.choice(TEXTS), "manifest.json", "1,2,3,4", "-1", "0"])
        record = f" {rng.choice(keys)}={value}\n".encode("utf-8", "surrogatepass")
        length = str(len(record) + len(str(len(record))))  # right, but for some that cross a power of ten
        out += rng.choice([length] * 9 + ["9" * 100_000, "0", "-5", "x"]).encode() + record
        if len(out) > 200_000:
            break
    return out
