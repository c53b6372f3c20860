"""`rx90 completion`."""

import argparse
from collections.abc import Iterator, Mapping

import scenarios.command_line.arguments as arguments
from scenarios.command_line.gains_file_arguments import gains_path
from scenarios.command_line.status import Status
from scenarios.command_line.streams_and_signals import tell
from scenarios.commands import COMMANDS
from scenarios.commands.overview import parser_of

SHELLS = {
    "bash": 'in ~/.bashrc: eval "$(rx90 completion bash)"',
    "zsh": "rx90 completion zsh > a folder of $fpath/_rx90",
    "fish": "rx90 completion fish > ~/.config/fish/completions/rx90.fish",
}
"""Names of shells with the use of their scripts."""
SCENARIOS, ROBOTS, METHODS = "scenarios", "robots", "methods"
KINDS = {"SCENARIO": SCENARIOS, "SCENARIO|FOLDER": SCENARIOS, "MOTION": SCENARIOS, "ROBOT": ROBOTS, "M": METHODS}
"""Values of an argument, by its name in the help."""
FUNCTIONS = {
    "bash": "_rx90_{kind}() {{ compgen -W '{names}' -- $1; compgen -f -- $1; }}",
    "zsh": "_rx90_{kind}() {{ _alternative 'names:{kind}:({names})' 'files:file:_files' }}",
    "fish": "function _rx90_{kind}\n  string split ' ' '{names}'\n  __fish_complete_path (commandline -ct)\nend",
}
"""Shell functions that complete a name or a file."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    said = "; ".join(f"{name}: {use}" for name, use in SHELLS.items())
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=said)


def main(options: argparse.Namespace) -> Status:
    """Print the script that completes every command in a shell."""
    import shtab

    whole = parser_of(COMMANDS)
    for action in _actions(whole):
        kind = KINDS.get(str(action.metavar))
        if action.choices is not None:
            action.choices = [str(choice) for choice in action.choices]  # shtab takes a mapping for commands
        elif action.type in (arguments.file, gains_path):
            action.complete = shtab.FILE  # pyright: ignore[reportAttributeAccessIssue] # where shtab looks for it
        elif action.type is arguments.folder:
            action.complete = shtab.DIRECTORY  # pyright: ignore[reportAttributeAccessIssue]
        elif kind is not None:
            action.complete = {  # pyright: ignore[reportAttributeAccessIssue]
                "bash": f"_rx90_{kind}",
                "zsh": f"_rx90_{kind}",
                "fish": f"(_rx90_{kind})",
            }
    tell(shtab.complete(whole, options.shell, preamble=functions(options.shell)) + "\n")
    return Status.PASSED


def functions(shell: str) -> str:
    """Return the beginning of a shell's script: its functions that complete names."""
    return "\n".join(FUNCTIONS[shell].format(kind=kind, names=" ".join(each)) for kind, each in _names().items())


def _names() -> Mapping[str, list[str]]:
    from ident.estimation.estimators import ESTIMATORS
    from scenarios.experiments.files.tables import builtin_names
    from scenarios.experiments.robots import ROBOTS as BUILT_IN

    return {SCENARIOS: builtin_names(), ROBOTS: list(BUILT_IN), METHODS: list(ESTIMATORS)}


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield all arguments of a parser and of its commands."""
    for action in parser._actions:  # pyright: ignore[reportPrivateUsage] # argparse has no other way to list them
        if isinstance(action, argparse._SubParsersAction):  # pyright: ignore[reportPrivateUsage]
            action.help = "what to do"  # the overview replaces it in the help; shtab skips commands without help
            for below in action.choices.values():
                yield from _actions(below)
        else:
            yield action
