"""``burrscan completion``."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator

from bench.cli.grammar import actions_of, subcommands_of

SUMMARY = "print the script that makes a shell complete burrscan's commands and options"
EXAMPLES = """\
  eval "$(burrscan completion bash)"                                        # in ~/.bashrc
  eval "$(burrscan completion zsh)"                                         # in ~/.zshrc
  burrscan completion fish > ~/.config/fish/completions/burrscan.fish"""

_BASH = """\
_burrscan() {{
  local words={top} command='' at
  for ((at = 1; at < COMP_CWORD; at++)); do
    case "${{COMP_WORDS[at]}}" in -*) ;; *) command="${{COMP_WORDS[at]}}"; break ;; esac
  done
  case "$command" in
{cases}
  esac
  case "$command ${{COMP_WORDS[COMP_CWORD-1]}}" in
{values}
  esac
  COMPREPLY=($(compgen -W "$words" -- "${{COMP_WORDS[COMP_CWORD]}}"))
}}
complete -o default -F _burrscan burrscan
"""
_SUITES_FOR = ("run", "show")
_FILES = ("FILE", "DIR")
"""How options call a value that is a file or a folder."""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
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
    values = "\n".join(
        f"    {'|'.join(shlex.quote(f'{name} {option}') for option in action.option_strings)}) "
        f"words={shlex.quote(' '.join(map(str, action.choices)))} ;;"
        for name, one in tree.items()
        for action in actions_of(one)
        if action.choices and action.option_strings
    )
    return _BASH.format(cases=cases, values=values, top=shlex.quote(" ".join([*tree, *_options(top)])))


def zsh(top: argparse.ArgumentParser) -> str:
    """The script for zsh: bash's, through zsh's own adapter."""
    return f"autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n{bash(top)}"


def fish(top: argparse.ArgumentParser) -> str:
    """The script for fish, with what the help says beside each word."""
    return "".join(f"complete -c burrscan {line}\n" for line in _fish_lines(top))


def _fish_lines(top: argparse.ArgumentParser) -> Iterator[str]:
    for action in actions_of(top):
        yield from _fish_options("__fish_use_subcommand", action)
    for name, one in subcommands_of(top).items():
        yield f"-n __fish_use_subcommand -f -a {name} -d {shlex.quote(_summary(one))}"
        when = shlex.quote(f"__fish_seen_subcommand_from {name}")
        for action in actions_of(one):
            yield from _fish_options(when, action)
        values = _values(name, one)
        if values:
            yield f"-n {when} -a {shlex.quote(' '.join(values))}"


def _fish_options(when: str, action: argparse.Action) -> Iterator[str]:
    """One action's options; a value that is one of a list, or no file, is not completed as a file."""
    for option in action.option_strings:
        kind = f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"
        says = shlex.quote((action.help or "").replace("%%", "%"))
        yield f"-n {when} {kind}{_fish_value(action)} -d {says}"


def _fish_value(action: argparse.Action) -> str:
    if action.nargs == 0:
        return ""
    if action.choices:
        return f" -x -a {shlex.quote(' '.join(map(str, action.choices)))}"
    return " -r" if action.metavar in _FILES else " -x"


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
