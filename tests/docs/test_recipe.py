"""The conda recipe: it renders, and asks for what the package asks for."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import motionmind

ROOT = Path(__file__).parents[2]
RECIPE = ROOT / "docs" / "conda" / "recipe.yaml"
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


@pytest.fixture(scope="module")
def rendered() -> dict[str, Any]:
    rattler = pytest.importorskip("rattler_build")
    (variant,) = rattler.Stage0Recipe.from_file(RECIPE).render()
    found: dict[str, Any] = variant.recipe.to_dict()
    return found


def test_the_recipe_renders_to_this_version_from_the_checkout(rendered: dict[str, Any]) -> None:
    assert rendered["package"] == {"name": "motionmind", "version": motionmind.__version__}
    assert [(RECIPE.parent / one["path"]).resolve() for one in rendered["source"]] == [ROOT]
    assert all((ROOT / name).exists() for name in rendered["about"]["license_file"])


def test_the_recipe_asks_for_what_the_package_asks_for(rendered: dict[str, Any]) -> None:
    wanted = {re.sub(r"(?<=\w)(?=[<>=])", " ", one) for one in PROJECT["dependencies"]}
    python = f"python {PROJECT['requires-python']}"
    assert set(rendered["requirements"]["run"]) == wanted | {python}
    assert python in rendered["requirements"]["host"]
    assert rendered["build"]["python"]["entry_points"] == [
        f"{name} = {function}" for name, function in PROJECT["scripts"].items()
    ]
