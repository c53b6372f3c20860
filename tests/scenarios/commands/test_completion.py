"""What shells complete."""

import re
import subprocess

import pytest

from ident.estimation.estimators import ESTIMATORS
from scenarios.cli import main
from scenarios.commands import COMMANDS
from scenarios.experiments.robots import ROBOTS
from scenarios.experiments.scenario_files import builtin_names

COMPLETED = [
    ("mon", {"monte-carlo"}),
    ("run nom", {"nominal"}),
    ("run nominal --se", {"--seed"}),
    ("identify --method l", {"ls-2011"}),
    ("compare nominal --method seq", {"sequential-2011"}),
    ("check ur1", {"ur10e"}),
    ("schema prob", {"problem"}),
    ("run nominal --save sub", {"subfolder"}),
    ("torque l", {"log.csv"}),
]


def test_bash_completes_commands_options_and_names(tmp_path, capsys):
    (tmp_path / "subfolder").mkdir()
    (tmp_path / "log.csv").touch()
    assert main(["completion", "bash"]) == 0
    (tmp_path / "rx90.bash").write_text(capsys.readouterr().out)
    asked = (
        "source ./rx90.bash; complete -p rx90 | grep -q _shtab_rx90 || exit 3; while read -r line; do "
        "COMP_WORDS=($line); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMPREPLY=(); _shtab_rx90; "
        'echo "${COMPREPLY[@]}"; done'
    )
    lines = "".join(f"rx90 {begun}\n" for begun, _ in COMPLETED)
    done = subprocess.run(["bash", "-c", asked], cwd=tmp_path, input=lines, capture_output=True, text=True, check=True)
    assert [set(line.split()) for line in done.stdout.splitlines()] == [names for _, names in COMPLETED]


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_have_every_scenario_robot_and_method_to_complete(shell, capsys):
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    for kind, names in (("scenarios", builtin_names()), ("robots", ROBOTS), ("methods", ESTIMATORS)):
        assert re.search(rf"_rx90_{kind}\b.*\n?.*{' '.join(names)}", text)
    assert all(f"{name}" in text for name in COMMANDS)
