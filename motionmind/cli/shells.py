"""The command that makes shells complete."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from motionmind.cli.options import command
from motionmind.errors import MotionMindError

_COMPLETION_VARIABLE = "_MOTIONMIND_COMPLETE"
# Else bash takes ballet/adagio@23 for three words, and completes the last as another argument.
_BASH_PREFIX = "COMP_WORDBREAKS=${COMP_WORDBREAKS//@/}\n"


@command("motionmind completion bash")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print what makes a shell complete commands, options, corpora, postures, joints and flows.

    Put eval "$(motionmind completion bash)" into ~/.bashrc, the same with zsh into ~/.zshrc, or, for fish, the output
    into ~/.config/fish/completions/motionmind.fish.
    """
    found = get_completion_class(shell)
    if found is None:
        raise MotionMindError(f"there is no completion for {shell}")
    source = found(context.find_root().command, {}, "motionmind", _COMPLETION_VARIABLE).source()
    click.echo((_BASH_PREFIX if shell == "bash" else "") + source)
