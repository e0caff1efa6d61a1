"""The style's mechanical part holds: the number of its known faults may only fall (`python -m tests.docs.prose`)."""

from __future__ import annotations

import prose
import pytest

# Known faults, which may only fall: lower a number when you remove some; 0 is the goal.
KNOWN = {
    "verbs": 0,
    "phrases": 0,
    "sentences": 0,
    "constants": 3,
    "ambiguous": 0,
    "changelog": 0,
    "pages": 0,
}


@pytest.mark.parametrize("rule", KNOWN)
def test_faults_only_become_fewer(rule: str) -> None:
    found = list(prose.RULES[rule]())
    assert len(found) <= KNOWN[rule], f"{len(found)} {rule}, more than {KNOWN[rule]}:\n" + "\n".join(map(str, found))


def test_docs_stay_short() -> None:
    assert prose.docs_words() <= prose.MAX_DOCS_WORDS


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    """A module and a page with faults."""
    text = '''"""A module, whoever reads it."""
_RATE, _FAR_M = 5.0, -1.0
STILL = 2 * 3
N_THINGS = 4
NAMES = {"a": 1}
class A:
    """A class."""
    def right(self):
        """Return it."""
    @property
    def also_right(self):
        """The thing."""
    def wrong(self):
        """Returns it."""
def lower():
    """return it, of
    which there is one."""
'''
    texts = {"a.py": text, "b.py": "STILL = 6.5\n_FAR_M = -1.0\n"}
    monkeypatch.setattr(prose, "sources", lambda: texts)
    monkeypatch.setattr(prose, "documents", lambda: {"docs/a.md": f"# Title\n\n- {'word ' * 41}.\n- A `b c d` word."})
    for cached in ("trees", "docstrings"):
        monkeypatch.setattr(prose, cached, getattr(prose, cached).__wrapped__)


@pytest.mark.usefixtures("toy")
def test_faults_are_found() -> None:
    assert [(one.line, one.text) for one in prose.verbs()] == [(13, "wrong: Returns it."), (15, "lower: return it, of")]
    assert [one.text for one in prose.phrases() if one.path == "a.py"] == ["whoever", "of which"]
    assert [str(one)[:22] for one in prose.sentences()] == ["docs/a.md:1: 41 words:"]
    assert [(one.line, one.text) for one in prose.constants() if one.path == "a.py"] == [(2, "_RATE"), (3, "STILL")]
    assert [one.text for one in prose.ambiguous()] == ["STILL: 6 in a.py, 6.5 in b.py"]
    assert list(prose.pages()) == []


def test_sentences_are_read_from_paragraphs_and_items() -> None:
    text = (
        "One. Two `x. Y` [a](b.c)!\n\n- Three\n  four.\n- Five\n\n    code. Code.\n\n| table |\n# Heading\nSix: seven"
    )
    assert [*prose.sentences_of(text)] == ["One.", "Two x a!", "Three four.", "Five", "Six: seven"]


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("# Changelog\n\n## Unreleased\n\n## 0.2.0 (2026-11-28)\n\n### Added\n\n- A thing.\n", []),
        ("## 0.2.0 (2026-11-28)\n", ["CHANGELOG.md:1: not of the form"]),
        ("## Unreleased\n## 0.1.0\n### News\n- A thing\n  or two.\n", [f"CHANGELOG.md:{n}: not" for n in (2, 3, 4, 5)]),
        ("## Unreleased\n## 0.2.0 (2026-11-28)\n" + "- One.\n" * 60, ["CHANGELOG.md:1: ## 0.2.0 (2026-11-28) has 61"]),
    ],
)
def test_the_form_of_a_changelog(text: str, faults: list[str]) -> None:
    found = [str(one) for one in prose.changelog_faults(text)]
    assert len(found) == len(faults)
    assert all(one.startswith(start) for one, start in zip(found, faults, strict=True))
