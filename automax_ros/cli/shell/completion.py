"""Print what makes a shell complete `automax`: subcommands, options and their words; elsewhere file names.

bash:  automax completion bash > ~/.local/share/bash-completion/completions/automax
zsh:   automax completion zsh > _automax, in a folder of $fpath
fish:  automax completion fish > ~/.config/fish/completions/automax.fish
"""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Callable, Sequence

from automax_ros.cli.shell.arguments import Command, Option, commands


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax completion``."""
    parser.add_argument("shell", choices=list(SHELLS), metavar="SHELL", help=", ".join(SHELLS))


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    print(SHELLS[arguments.shell](commands()), end="")
    return 0


def bash(found: Sequence[Command]) -> str:
    """Return the script for bash 4 or later; readline shows words without descriptions."""
    every = [inner for command in found for inner in command.all()]
    choices = [
        f'        "{_path(command)} {name}") words={_quote(option.values)} ;;'
        for command in every
        for option in command.options
        if option.values
        for name in option.names
    ]
    words = [f'        "{_path(command)}") words={_quote(_words(command))} ;;' for command in every]
    return f"""# bash completion of automax
_automax() {{
    local current=${{COMP_WORDS[COMP_CWORD]}} path="" words="" i
    for ((i = 1; i < COMP_CWORD; i++)); do
        case "$path ${{COMP_WORDS[i]}}" in
        {_paths(every)}) path="$path ${{COMP_WORDS[i]}}" ;;
        esac
    done
    case "$path ${{COMP_WORDS[COMP_CWORD - 1]}}" in
{_lines(choices)}
    *)
        case "$path" in
        "") words={_quote([command.words[-1] for command in found])} ;;
{_lines(words)}
        esac
        ;;
    esac
    COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _automax automax
"""


def zsh(found: Sequence[Command]) -> str:
    """Return the script for zsh."""
    every = [inner for command in found for inner in command.all()]
    cases = [f'        ("{_path(command)}") found=({_described(command)}) ;;' for command in every]
    first = " ".join(_pair(command.words[-1], command.title) for command in found)
    return f"""#compdef automax
_automax() {{
    local path_="" i
    local -a found
    for ((i = 2; i < CURRENT; i++)); do
        case "$path_ ${{words[i]}}" in
        ({_paths(every)}) path_="$path_ ${{words[i]}}" ;;
        esac
    done
    case "$path_" in
        ("") found=({first}) ;;
{_lines(cases)}
    esac
    _describe automax found
    if [[ -n $path_ ]]; then _files; fi
}}
compdef _automax automax
"""


def fish(found: Sequence[Command]) -> str:
    """Return the script for fish."""
    lines = [f"complete -c automax -f -n '__automax_at \"\"' {_fish_word(item)}" for item in found]
    for command in (inner for item in found for inner in item.all()):
        here = f"complete -c automax -n '__automax_at \"{_path(command)}\"'"
        lines += [f"{here} {_fish_word(inner)}" for inner in command.inner]
        lines += [f"{here} {_fish_option(option)}" for option in command.options]
        lines += [f"{here} -f -a {_quote(item.values)}" for item in command.positionals if item.values]
    paths = " ".join(f'"{_path(inner)}"' for item in found for inner in item.all())
    return f"""# fish completion of automax
function __automax_at
    set -l path ""
    for word in (commandline -opc)[2..-1]
        if contains -- "$path $word" {paths}
            set path "$path $word"
        end
    end
    test "$path" = "$argv[1]"
end
{_lines(lines)}
"""


SHELLS: dict[str, Callable[[Sequence[Command]], str]] = {"bash": bash, "zsh": zsh, "fish": fish}
"""The function that returns the script for each shell."""


def _path(command: Command) -> str:
    return "".join(f" {word}" for word in command.words)


def _paths(every: Sequence[Command]) -> str:
    return " | ".join(f'"{_path(command)}"' for command in every)


def _words(command: Command) -> list[str]:
    """Return the words that may follow a subcommand: its own subcommands, the words of its arguments, its options."""
    inner = [item.words[-1] for item in command.inner]
    values = [value for item in command.positionals for value in item.values]
    return inner + values + [name for option in command.options for name in option.names]


def _described(command: Command) -> str:
    inner = [_pair(item.words[-1], item.title) for item in command.inner]
    values = [_pair(value, item.text) for item in command.positionals for value in item.values]
    return " ".join(inner + values + [_pair(name, option.text) for option in command.options for name in option.names])


def _pair(word: str, text: str) -> str:
    escaped = word.replace(":", "\\:")
    return shlex.quote(f"{escaped}:{' '.join(text.split())}")


def _fish_word(command: Command) -> str:
    return f"-a {command.words[-1]} -d {_fish_text(command.title)}"


def _fish_option(option: Option) -> str:
    names = [f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in option.names]
    takes = [] if not option.takes_value else ["-x", "-a", _quote(option.values)] if option.values else ["-r"]
    return " ".join([*names, *takes, "-d", _fish_text(option.text)])


def _fish_text(text: str) -> str:
    """Return a text in fish's quotes: a quote in it is escaped by a backslash, within the quotes."""
    plain = " ".join(text.split()).replace("\\", "\\\\").replace("'", "\\'")
    return f"'{plain}'"


def _quote(words: Sequence[str]) -> str:
    return f'"{" ".join(words)}"'


def _lines(lines: Sequence[str]) -> str:
    return "\n".join(lines)
