"""The completion command: print the completion script of a shell."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from motionmind.cli.options import command
from motionmind.errors import MotionMindError


@command("motionmind completion bash")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print a script that completes commands, options, corpora, postures, joints and flows in a shell.

    Put eval "$(motionmind completion bash)" into ~/.bashrc, the same with zsh into ~/.zshrc, or, for fish, the output
    into ~/.config/fish/completions/motionmind.fish.
    """
    found = get_completion_class(shell)
    if found is None:
        raise MotionMindError(f"there is no completion for {shell}")
    source = found(context.find_root().command, {}, "motionmind", "_MOTIONMIND_COMPLETE").source()
    if shell == "bash":  # or bash would take ballet/adagio@23 for three words, and complete the last on its own
        source = "COMP_WORDBREAKS=${COMP_WORDBREAKS//@/}\n" + source
    click.echo(source)
