"""List what breaks the mechanical part of the style: verbs of docstrings, phrases, sentences, constants, sizes.

python -m tests.docs.prose
python -m tests.docs.prose constants sentences
"""

from __future__ import annotations

import ast
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
MAX_SENTENCE_WORDS = 40
MAX_DOCS_WORDS = 28_000
MAX_PAGE_WORDS = 1_500
MAX_DESIGN_WORDS = 1_000  # of a page below docs/design, which explains a decision
REFERENCE = {"docs/formats.md", "docs/notation.md", "docs/references.md"}

# First words of a function's docstring that are no imperative.
NO_VERBS = {
    *("A", "An", "The", "This", "These", "Those", "That", "What", "Which", "Whether", "Who", "How", "Where", "When"),
    *(
        "Is",
        "Are",
        "Has",
        "Have",
        "Was",
        "Does",
        "It",
        "Its",
        "One",
        "All",
        "No",
        "For",
        "With",
        "Of",
        "In",
        "As",
        "If",
    ),
    *("Returns", "Yields", "Computes", "Gives", "Makes", "Reads", "Writes", "Checks", "Raises", "Runs", "Sets", "Gets"),
}
BANNED = (
    *("what is said", "those that", "those who", "whoever", "whatever is", "is looked at", "are looked at", "of which"),
    *("so that none", "was asked for", "is asked for", "were asked for", "is looked up", "are looked up"),
)
UNITS = (
    *(
        "M",
        "MM",
        "CM",
        "KM",
        "S",
        "MS",
        "RAD",
        "RAD2",
        "DEG",
        "MPS",
        "MPS2",
        "RADPS",
        "RADPS2",
        "RAD_S",
        "M_S",
        "HZ",
        "FPS",
        "PX",
    ),
    *("KG", "N", "BYTES", "MB", "NATS", "FRAMES", "WORDS", "LINES", "CHARS", "COLUMNS", "ROWS", "DAYS", "MINUTES"),
    *(
        "RATIO",
        "SHARE",
        "COUNT",
        "VERSION",
        "PORT",
        "SEED",
        "FACTOR",
        "WEIGHT",
        "EXPONENT",
        "QUANTILE",
        "PERCENTILE",
        "LEVEL",
        "CODE",
        "SCALE",
        "M2",
    ),
)
FREE = re.compile(
    r"^(N|MAX|MIN|P)_|TOLERANCE|EPSILON|\bEPS$|BITS$"
)  # counts, bounds of counts, probabilities, rounding


class Fault(NamedTuple):
    """A place that breaks a rule."""

    path: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.text}"


@cache
def sources() -> dict[str, str]:
    """Read the modules of motionmind, by path."""
    return _texts(ROOT.glob("motionmind/**/*.py"))


@cache
def documents() -> dict[str, str]:
    """Read the documents, by path."""
    pages = [path for path in ROOT.glob("docs/**/*.md") if "_build" not in path.parts]
    return _texts([*ROOT.glob("*.md"), *pages])


def _texts(paths: Iterator[Path] | Sequence[Path]) -> dict[str, str]:
    return {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in sorted(paths)}


@cache
def trees() -> dict[str, ast.Module]:
    """Parse the modules of motionmind, by path."""
    return {path: ast.parse(text) for path, text in sources().items()}


class Docstring(NamedTuple):
    """A docstring, its node and the path of its module."""

    path: str
    node: ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    text: str


@cache
def docstrings() -> list[Docstring]:
    """Return the docstrings of modules, classes, functions and methods of motionmind."""
    return [found for path, tree in trees().items() for found in _docstrings(path, tree)]


def _docstrings(path: str, node: ast.AST) -> Iterator[Docstring]:
    if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
        if text := ast.get_docstring(node):
            yield Docstring(path, node, text)
        for child in node.body:
            yield from _docstrings(path, child)


def is_property(node: ast.AST) -> bool:
    """Return whether a function is a property, whose docstring is a noun phrase."""
    return any(ast.unparse(one).endswith("property") for one in getattr(node, "decorator_list", []))


def verbs() -> Iterator[Fault]:
    """Yield docstrings of functions that do not begin with a capitalised verb in the imperative."""
    for path, node, text in docstrings():
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not is_property(node):
            first = re.split(r"[^\w'-]", text, maxsplit=1)[0]
            if first in NO_VERBS or not first[:1].isupper():
                yield Fault(path, node.lineno, f"{node.name}: {text.splitlines()[0]}")


def phrases() -> Iterator[Fault]:
    """Yield banned phrases in documents and in the comments, strings and docstrings of Python and JavaScript."""
    # They are of several words, which occur nowhere else in code; a line may end inside one.
    pattern = re.compile(r"\b(" + "|".join(one.replace(" ", r"\s+(?:(?:#|//|\*) )?") for one in BANNED) + r")\b", re.I)
    scripts = _texts(ROOT.glob("motionmind/**/*.js"))
    for path, text in {**documents(), **sources(), **scripts}.items():
        for found in pattern.finditer(text):
            yield Fault(path, text.count("\n", 0, found.start()) + 1, " ".join(found[0].split()))


def sentences_of(text: str) -> Iterator[str]:
    """Yield the sentences of Markdown or of a docstring: of its paragraphs and items, not of code and tables."""
    text = re.sub(r"^( *)```.*?^\1```$", "", text, flags=re.M | re.S)
    lines = [
        line for line in text.splitlines() if not re.match(r" {4,}|\||#|>>> ", line) or re.match(r" {4}\w+: ", line)
    ]
    for block in re.split(r"\n\s*\n(?: *(?:[-*]|\d+\.) +)?|\n *(?:[-*]|\d+\.) +|\n +(?=\w+: )", "\n".join(lines)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "x", " ".join(block.split())))
        yield from re.split(r"(?<=[.!?:;])['\")*]* +(?=[A-Z`\"(*\[x])", words)


def sentences() -> Iterator[Fault]:
    """Yield sentences of documents and docstrings that are too long, with their words."""
    texts = [(path, 1, text) for path, text in documents().items()]
    texts += [(path, getattr(node, "lineno", 1), text) for path, node, text in docstrings()]
    for path, line, text in texts:
        for sentence in sentences_of(text):
            if (count := len(re.findall(r"\w[\w'-]*", sentence))) > MAX_SENTENCE_WORDS:
                yield Fault(path, line, f"{count} words: {sentence[:100]}")


def is_number(node: ast.AST | None) -> bool:
    """Return whether an expression is a number, written out or computed from numbers."""
    match node:
        case ast.Constant(value=value):
            return isinstance(value, int | float) and not isinstance(value, bool)
        case ast.UnaryOp(operand=operand):
            return is_number(operand)
        case ast.BinOp(left=left, right=right):
            return is_number(left) and is_number(right)
    return False


def named_numbers() -> Iterator[tuple[Fault, float]]:
    """Yield the numeric constants of modules, each with its value; the text of a fault is its name."""
    for path, tree in trees().items():
        for node in tree.body:
            pairs: list[tuple[ast.expr, ast.expr | None]] = []
            if isinstance(node, ast.Assign):
                pairs = [(target, node.value) for target in node.targets]
            elif isinstance(node, ast.AnnAssign):
                pairs = [(node.target, node.value)]
            for target, value in list(pairs):
                if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                    pairs += zip(target.elts, value.elts, strict=False)
            for target, value in pairs:
                if isinstance(target, ast.Name) and re.fullmatch(r"_?[A-Z][A-Z0-9_]+", target.id) and is_number(value):
                    number = eval(compile(ast.Expression(value), path, "eval"), {})
                    yield Fault(path, node.lineno, target.id), number


def constants() -> Iterator[Fault]:
    """Yield numeric constants without a unit in their names."""
    for fault, _ in named_numbers():
        name = fault.text.strip("_")
        if not name.endswith(tuple(f"_{unit}" for unit in UNITS)) and name not in UNITS and not FREE.search(name):
            yield fault


def ambiguous() -> Iterator[Fault]:
    """Yield numeric constants of one name and different values."""
    found: defaultdict[str, list[tuple[Fault, float]]] = defaultdict(list)
    for fault, value in named_numbers():
        found[fault.text.strip("_")].append((fault, value))
    for name, pairs in found.items():
        if len({value for _, value in pairs}) > 1:
            first = pairs[0][0]
            rest = ", ".join(f"{value:g} in {fault.path}" for fault, value in pairs)
            yield Fault(first.path, first.line, f"{name}: {rest}")


HEADINGS = ("Added", "Changed", "Fixed", "Removed")


def changelog() -> Iterator[Fault]:
    """Yield what breaks the form of the changelog."""
    yield from changelog_faults(documents()["CHANGELOG.md"])


def changelog_faults(text: str) -> Iterator[Fault]:
    """Yield the lines of a changelog that are not "# Changelog", a version, a heading or an item of one line."""
    versions: Counter[str] = Counter()
    version = ""
    for number, line in enumerate(text.splitlines(), 1):
        reason = ""
        if line.startswith("## "):
            form = r"## Unreleased" if not version else r"## \d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\)"
            reason = "" if re.fullmatch(form, line) else f"not of the form {form}"
            version = line
        elif line.startswith("### "):
            reason = "" if line[4:] in HEADINGS else f"not one of {', '.join(HEADINGS)}"
        elif line and line != "# Changelog" and not re.match(r"- \S.*\.$", line):
            reason = "not an item of one line, which ends with a full stop"
        if reason:
            yield Fault("CHANGELOG.md", number, f"{reason}: {line[:60]}")
        versions[version] += bool(line)
    for version, count in versions.items():
        if version.startswith("## 0.2.0") and count > 60:
            yield Fault("CHANGELOG.md", 1, f"{version} has {count} lines, more than 60")


def words_of(path: str) -> int:
    """Count the words of a document."""
    return len(documents()[path].split())


def pages() -> Iterator[Fault]:
    """Yield the documents that are too long; reference pages may be longer."""
    for path in documents():
        limit = MAX_DESIGN_WORDS if path.startswith("docs/design/") else MAX_PAGE_WORDS
        if path not in REFERENCE and path != "CHANGELOG.md" and (count := words_of(path)) > limit:
            yield Fault(path, 1, f"{count} words, more than {limit}")


def docs_words() -> int:
    """Count the words of all pages below docs."""
    return sum(words_of(path) for path in documents() if path.startswith("docs/"))


RULES = {rule.__name__: rule for rule in (verbs, phrases, sentences, constants, ambiguous, changelog, pages)}


def main(names: Sequence[str]) -> None:
    """Print the faults of some rules, or of all."""
    for name in names or RULES:
        found = list(RULES[name]())
        print("\n".join(map(str, found)))
        print(f"--- {name}: {len(found)}\n")
    print(f"--- words of docs: {docs_words()}")


if __name__ == "__main__":
    main(sys.argv[1:])
