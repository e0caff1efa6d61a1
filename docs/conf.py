"""How Sphinx builds the documents: `sphinx-build -W -q -b html docs docs/_build`."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE / "_extensions")]

import motionmind  # noqa: E402

project = "MotionMind"
author = "The MotionMind authors"
copyright = author  # noqa: A001 (Sphinx's name)
release = version = motionmind.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "docstrings",
    "reference",
]
exclude_patterns = ["_build", "_extensions"]
default_role = "code"
smartquotes = False  # options begin with two hyphens
html_theme = "furo"
html_title = "MotionMind"
html_show_copyright = False
html_copy_source = False

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
suppress_warnings = ["myst.xref_missing"]  # links out of docs/; tests/docs/test_documents.py follows every link

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
