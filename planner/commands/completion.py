"""Completion for shells, made from the program itself: commands, their options, else files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner.errors import InputError

SHELLS = ("bash", "zsh", "fish")

_BASH = """_planner() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" options=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "{commands}" -- "$word")); return
  fi
  case "${{COMP_WORDS[1]}}" in
{cases}
  esac
  if [[ "$word" == -* ]]; then COMPREPLY=($(compgen -W "$options" -- "$word"))
  else COMPREPLY=($(compgen -f -- "$word")); fi
}}
complete -o filenames -F _planner planner"""


def completion(program: Any, shell: str) -> str:
    """The lines that a shell reads to complete `planner`: `eval "$(planner --show-completion bash)"`.

    program: typer's command group. Raises InputError for a shell that we do not know.
    """
    if shell not in SHELLS:
        raise InputError(f"--show-completion {shell}: there is {', '.join(SHELLS)}")
    options = {
        name: [word for p in one.params for word in (*p.opts, *p.secondary_opts) if word.startswith("-")]
        for name, one in program.commands.items()
    }
    if shell == "fish":
        return "\n".join(_fish(options))
    cases = "\n".join(f'    {name}) options="{" ".join(words)}" ;;' for name, words in options.items())
    bash = _BASH.format(commands=" ".join(options), cases=cases)
    return f"autoload -U +X bashcompinit && bashcompinit\n{bash}" if shell == "zsh" else bash


def _fish(options: Mapping[str, list[str]]) -> list[str]:
    lines = [f"complete -c planner -n __fish_use_subcommand -f -a {name}" for name in options]
    for name, words in options.items():
        within = f"complete -c planner -n '__fish_seen_subcommand_from {name}'"
        lines += [
            f"{within} -l {word[2:]}" if word.startswith("--") else f"{within} -s {word[1:]}"
            for word in words
        ]
    return lines
