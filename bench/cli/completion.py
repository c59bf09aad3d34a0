"""``burrscan completion``."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator

from bench.cli.grammar import Commands, actions_of, command, subcommands_of

_EXAMPLES = """\
  eval "$(burrscan completion bash)"                                        # in ~/.bashrc
  eval "$(burrscan completion zsh)"                                         # in ~/.zshrc
  burrscan completion fish > ~/.config/fish/completions/burrscan.fish"""

_BASH = """\
_burrscan() {{
  local words
  case "${{COMP_WORDS[1]}}" in
{cases}
    *) words={top} ;;
  esac
  [ "$COMP_CWORD" -eq 1 ] && words={top}
  COMPREPLY=($(compgen -W "$words" -- "${{COMP_WORDS[COMP_CWORD]}}"))
}}
complete -o default -F _burrscan burrscan
"""
_SUITES_FOR = ("run", "show")


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "completion",
        main,
        summary="print the script that makes a shell complete burrscan's commands and options",
        examples=_EXAMPLES,
    )
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="bash, zsh or fish")


def main(given: argparse.Namespace) -> int:
    """Print the script."""
    from bench.cli.program import parser

    top = parser()
    print({"bash": bash, "zsh": zsh, "fish": fish}[given.shell](top), end="")
    return 0


def bash(top: argparse.ArgumentParser) -> str:
    """The script for bash; what it does not know is completed as a file's name."""
    tree = subcommands_of(top)
    cases = "\n".join(
        f"    {name}) words={shlex.quote(' '.join([*_options(one), *_values(name, one)]))} ;;"
        for name, one in tree.items()
    )
    return _BASH.format(cases=cases, top=shlex.quote(" ".join([*tree, *_options(top)])))


def zsh(top: argparse.ArgumentParser) -> str:
    """The script for zsh: bash's, through zsh's own adapter."""
    return f"autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n{bash(top)}"


def fish(top: argparse.ArgumentParser) -> str:
    """The script for fish, with what the help says beside each word."""
    return "".join(f"complete -c burrscan {line}\n" for line in _fish_lines(top))


def _fish_lines(top: argparse.ArgumentParser) -> Iterator[str]:
    for name, one in subcommands_of(top).items():
        yield f"-n __fish_use_subcommand -f -a {name} -d {shlex.quote(_summary(one))}"
        when = f"-n '__fish_seen_subcommand_from {name}'"
        for action in actions_of(one):
            for option in action.option_strings:
                kind = f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"
                takes = " -r" if action.nargs != 0 else ""
                yield f"{when} {kind}{takes} -d {shlex.quote((action.help or '').replace('%%', '%'))}"
        values = _values(name, one)
        if values:
            yield f"{when} -a {shlex.quote(' '.join(values))}"


def _summary(parser: argparse.ArgumentParser) -> str:
    return (parser.description or "").partition(".")[0]


def _options(parser: argparse.ArgumentParser) -> list[str]:
    return [option for action in actions_of(parser) for option in action.option_strings]


def _values(name: str, parser: argparse.ArgumentParser) -> list[str]:
    """What a command's arguments may be, where that is a list."""
    from bench.suites.catalogue import suite_names

    listed = [
        str(each) for a in actions_of(parser) if a.choices and not a.option_strings for each in a.choices
    ]
    return [*listed, *(suite_names() if name in _SUITES_FOR else [])]
