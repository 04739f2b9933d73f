"""`dsl completion`: scripts that complete commands, options, scenes and words, as known when they are printed."""

from __future__ import annotations

import argparse
from importlib import import_module

OF_SCENES = ("check", "plan", "run", "judge", "compare", "stress", "export", "board", "fmt")  # these take scenes
Options = dict[str, list[str]]  # by command


def arguments(parser: argparse.ArgumentParser) -> None:
    """SHELL"""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help='for example: eval "$(dsl completion bash)"')


def run(parsed: argparse.Namespace) -> int:
    """Print the script of a shell."""
    from softmark.interpreter.cli.commands.listing import _topics
    from softmark.interpreter.front.catalogue import CATALOGUE
    from softmark.interpreter.language.sources import standard_scenes

    words = sorted({*CATALOGUE, *(n for t in CATALOGUE.values() for n in t), *CATALOGUE.words()})
    script = {"bash": _bash, "zsh": _zsh, "fish": _fish}[parsed.shell]
    print(script(_options(), list(standard_scenes()), words, list(_topics(CATALOGUE))))
    return 0


def _options() -> Options:
    """What each command says that it takes."""
    from softmark.interpreter.cli.main import COMMANDS

    found = {}
    for name, (module, _) in COMMANDS.items():
        parser = argparse.ArgumentParser(add_help=False)
        import_module(f"softmark.interpreter.cli.commands.{module}").arguments(parser)
        found[name] = [option for action in parser._actions for option in action.option_strings]
    return found


def _bash(options: Options, scenes: list[str], words: list[str], topics: list[str]) -> str:
    cases = "\n".join(f'    {c}) options="{" ".join(own)}" ;;' for c, own in options.items())
    return f"""# completion of dsl for bash: eval "$(dsl completion bash)"
_dsl() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} options=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "{" ".join(options)} --help --version" -- "$current")); return
  fi
  case ${{COMP_WORDS[1]}} in
{cases}
  esac
  case ${{COMP_WORDS[1]}} in
    {"|".join(OF_SCENES)})
      COMPREPLY=($(compgen -W "$options {" ".join(scenes)}" -- "$current"))
      COMPREPLY+=($(compgen -f -X '!*.scene' -- "$current") $(compgen -d -- "$current")) ;;
    explain) COMPREPLY=($(compgen -W "$options {" ".join(words)}" -- "$current")) ;;
    list) COMPREPLY=($(compgen -W "$options {" ".join(topics)}" -- "$current")) ;;
    completion) COMPREPLY=($(compgen -W "bash zsh fish" -- "$current")) ;;
    *) COMPREPLY=($(compgen -W "$options" -- "$current")) ;;
  esac
}}
complete -o filenames -F _dsl dsl"""


def _zsh(options: Options, scenes: list[str], words: list[str], topics: list[str]) -> str:
    return f"autoload -U +X bashcompinit && bashcompinit\n{_bash(options, scenes, words, topics)}"


def _fish(options: Options, scenes: list[str], words: list[str], topics: list[str]) -> str:
    lines = ["# completion of dsl for fish: dsl completion fish | source", "complete -c dsl -f"]
    lines.append(f"complete -c dsl -n __fish_use_subcommand -a '{' '.join(options)}'")
    for command, own in options.items():
        for option in own:
            flag = f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"
            lines.append(f"complete -c dsl -n '__fish_seen_subcommand_from {command}' {flag}")
    lines.append(f"complete -c dsl -F -n '__fish_seen_subcommand_from {' '.join(OF_SCENES)}' -a '{' '.join(scenes)}'")
    lines.append(f"complete -c dsl -n '__fish_seen_subcommand_from explain' -a '{' '.join(words)}'")
    lines.append(f"complete -c dsl -n '__fish_seen_subcommand_from list' -a '{' '.join(topics)}'")
    return "\n".join(lines)
