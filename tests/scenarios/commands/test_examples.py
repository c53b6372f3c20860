import shlex
from collections import Counter

import pytest

from scenarios.cli import main, parser_of
from scenarios.commands import COMMANDS, EXAMPLES


def test_each_command_has_two_examples_that_it_understands(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert Counter(line.split()[1] for line in EXAMPLES) == dict.fromkeys(COMMANDS, 2)
    for line in EXAMPLES:
        _, name, *words = shlex.split(line)
        parser_of([name]).parse_args([name, *words])
    with pytest.raises(SystemExit, match="0"):
        main(["convert", "--help"])
    shown = capsys.readouterr().out.partition("examples:\n")[2].replace("\\\n", "").splitlines()
    assert list(map(shlex.split, shown)) == [shlex.split(line) for line in EXAMPLES if " convert " in line]
    main([])
    first = capsys.readouterr().out.partition("begin with:\n")[2].partition("\n\n")[0].replace("\\\n", "").splitlines()
    assert [line.split()[1] for line in first] == ["run", "check", "identify"]
