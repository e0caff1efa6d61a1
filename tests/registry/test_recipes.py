"""The recipes that come with MotionMind are complete, and their commands are commands of this version."""

from __future__ import annotations

import re
import shlex

import click
import pytest

from motionmind.cli import app
from motionmind.corpus.store import place_for
from motionmind.credits.licences import UNKNOWN, find_licence
from motionmind.registry.index import Recipe, open_index

RECIPES = open_index(None).index.recipes
COLLECTIONS = {"100style", "aist", "amass", "bandai-1", "bandai-2", "cmu", "lafan1", "motorica"}


def test_the_index_holds_recipes_and_passes_nothing_on() -> None:
    index = open_index(None).index
    assert {recipe.name for recipe in index.recipes} == COLLECTIONS
    assert index.corpora == ()


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)
def test_a_recipe_says_all_that_one_must_know(recipe: Recipe) -> None:
    assert all(getattr(recipe, field) for field in recipe.__struct_fields__)
    assert re.match("https?://", recipe.source)
    place_for(recipe.name)
    assert any(re.search(rf"motionmind corpus build {recipe.name} ", step) for step in recipe.steps)


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)
def test_the_commands_of_a_recipe_are_commands_of_this_version(recipe: Recipe) -> None:
    lines = [step for step in recipe.steps if step.startswith("motionmind ")]
    assert lines
    for line in lines:
        _, group, name, *words = shlex.split(line)
        command = app.commands[group]
        assert isinstance(command, click.Group)
        context = click.Context(command.commands[name], info_name=name)
        values, left, _ = command.commands[name].make_parser(context).parse_args(words)
        assert left == []
        assert all(values[key] for key in ("title", "author", "source", "licence"))
        assert values["source"] == recipe.source
        assert values["citation"] == recipe.citation.replace('"', "'")


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)
def test_the_licence_of_a_recipe_is_one_whose_terms_are_known(recipe: Recipe) -> None:
    known = find_licence(recipe.licence)
    assert known.allows_derivatives == (recipe.name != "lafan1")
    assert known.is_open == (recipe.name not in ("amass", "motorica"))
    assert (known is UNKNOWN) == (recipe.name == "cmu")  # terms of its own, which no licence has
