"""Methods asked for answers to problem folders, whose truth nobody here knows."""

from collections.abc import Sequence
from pathlib import Path

from scenarios.benchmark.methods.answers import AnswerRow, answer_row, problem_digest, read_answers, write_answers
from scenarios.benchmark.methods.call import call
from scenarios.benchmark.methods.method import Method
from scenarios.benchmark.methods.process import Limits
from scenarios.results.problem_folder import read_problem
from scenarios.support.errors import ScenarioError
from scenarios.support.stages import SILENT, Stages, counted


def answered(
    folders: Sequence[Path], methods: Sequence[Method], limits: Limits, path: Path, *, stages: Stages = SILENT
) -> tuple[AnswerRow, ...]:
    """Ask every method for every problem, and write each answer down when it is there.

    Args:
        folders: Problems, each under a name of its own.
        methods: Those that are asked.
        limits: What a call may take.
        path: File of answers; of those that it holds, none is asked for again.
        stages: Told how many calls are done.

    Returns:
        All answers of the file.

    Raises:
        ScenarioError: If two folders have one name.
        ForeignProblem: If a folder holds no problem that can be read.
        ScenarioError: If the file holds something else.
    """
    names = [folder.name for folder in folders]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ScenarioError(f"two problem folders are called {twice}; rename one, answers are stored under that name")
    joints = {folder: read_problem(folder).arm.n for folder in folders}
    rows = list(read_answers(path)) if path.exists() else []
    stages.begin("asking", len(folders) * len(methods))
    for folder in folders:
        digest = problem_digest(folder)
        for method in counted(methods, stages):
            wanted = folder.name, digest, method.text, dict(method.digests)
            if any((row.problem, row.digest, row.method, row.files) == wanted for row in rows):
                continue
            rows = [row for row in rows if (row.problem, row.method) != (folder.name, method.text)]
            rows.append(answer_row(folder, method, call(method, folder, joints[folder], limits)))
            write_answers(rows, path)
    return tuple(rows)
