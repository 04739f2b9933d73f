"""`dsl completion`: scripts that complete commands, options, scenes and words, as known when they are printed."""

from __future__ import annotations

import argparse

OPTIONS = {
    "check": "-p --plugin --diagnostics",
    "plan": "-p --plugin --model",
    "run": "-p --plugin --model --out --json --junit --vtu --repeat",
    "compare": "-p --plugin --model --vary --study --out --json --jobs --cluster --timeout --repeats --resume --fresh"
    " --allow-contaminated",
    "judge": "-p --plugin --as --unit --at --rest --time --within --by --body --out --json --junit",
    "stress": "-p --plugin --model --study --out --json --jobs --timeout --memory --resume --fresh",
    "export": "-p --plugin --model --to --out",
    "board": "--out --json --against --also --check --jobs --cluster --timeout --repeats --resume --fresh"
    " --allow-contaminated",
    "import": "--out --units --unit --stress --time --material --density",
    "fmt": "--check",
    "new": "--list",
    "conformance": "",
    "explain": "--plugin",
    "list": "--plugin",
    "completion": "",
}


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
    print(script(list(standard_scenes()), words, list(_topics(CATALOGUE))))
    return 0


def _bash(scenes: list[str], words: list[str], topics: list[str]) -> str:
    cases = "\n".join(f'    {c}) options="{o}" ;;' for c, o in OPTIONS.items())
    return f"""# completion of dsl for bash: eval "$(dsl completion bash)"
_dsl() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} options=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "{" ".join(OPTIONS)} --help --version" -- "$current")); return
  fi
  case ${{COMP_WORDS[1]}} in
{cases}
  esac
  case ${{COMP_WORDS[1]}} in
    check|plan|run|judge|compare|stress|export|board|fmt)
      COMPREPLY=($(compgen -W "$options {" ".join(scenes)}" -- "$current"))
      COMPREPLY+=($(compgen -f -X '!*.scene' -- "$current") $(compgen -d -- "$current")) ;;
    explain) COMPREPLY=($(compgen -W "{" ".join(words)}" -- "$current")) ;;
    list) COMPREPLY=($(compgen -W "{" ".join(topics)}" -- "$current")) ;;
    completion) COMPREPLY=($(compgen -W "bash zsh fish" -- "$current")) ;;
    *) COMPREPLY=($(compgen -W "$options" -- "$current")) ;;
  esac
}}
complete -o filenames -F _dsl dsl"""


def _zsh(scenes: list[str], words: list[str], topics: list[str]) -> str:
    return f"autoload -U +X bashcompinit && bashcompinit\n{_bash(scenes, words, topics)}"


def _fish(scenes: list[str], words: list[str], topics: list[str]) -> str:
    lines = ["# completion of dsl for fish: dsl completion fish | source", "complete -c dsl -f"]
    lines.append(f"complete -c dsl -n __fish_use_subcommand -a '{' '.join(OPTIONS)}'")
    for command, options in OPTIONS.items():
        for option in options.split():
            flag = f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"
            lines.append(f"complete -c dsl -n '__fish_seen_subcommand_from {command}' {flag}")
    lines.append(
        "complete -c dsl -F -n '__fish_seen_subcommand_from check plan run judge compare stress export board fmt'"
        f" -a '{' '.join(scenes)}'"
    )
    lines.append(f"complete -c dsl -n '__fish_seen_subcommand_from explain' -a '{' '.join(words)}'")
    lines.append(f"complete -c dsl -n '__fish_seen_subcommand_from list' -a '{' '.join(topics)}'")
    return "\n".join(lines)
