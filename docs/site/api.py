"""Pages of what can be imported, for mkdocstrings to fill from the docstrings."""

MODULES = {
    "ident": {
        "Identify": (
            "identification",
            "observation.observation",
            "estimation.estimate",
            "estimation.gain_comparison",
        ),
        "Read": (
            "recordings.recording",
            "recordings.files",
            "payload.payload",
            "model.arm",
            "model.structure",
        ),
        "Use the gains": (
            "unseen",
            "estimation.known_gains",
            "parameters.weighing",
            "parameters.payload",
            "parameters.arm",
        ),
        "Look at logs": (
            "preparation",
            "diagnosis.diagnosis",
            "recordings.formats",
            "recordings.description",
        ),
        "Write an estimator": (
            "estimation.estimators",
            "estimation.problem",
            "estimation.joint_by_joint",
            "estimation.intervals",
        ),
        "Mathematics": (
            "model.regressor",
            "model.parameters",
            "numerics.signals",
            "numerics.least_squares",
        ),
        "Errors": ("support.errors",),
    },
    "sim": {
        "Plant": ("plant", "robot"),
        "Record": ("record", "experiment", "trajectory", "controller", "sensors"),
        "Write an effect or a sensor": ("effects", "effects.effect", "sensors.sensor"),
        "Errors": ("errors",),
    },
    "scenarios": {
        "Run": (
            "experiments.run",
            "experiments.judge",
            "experiments.verdict",
            "experiments.trials",
            "experiments.loaded_scenario",
        ),
        "Read and change scenarios": (
            "experiments.scenario",
            "experiments.schema",
            "experiments.motions",
            "results.gains_file",
        ),
        "Studies": (
            "experiments.study",
            "experiments.statistics",
            "results.studies",
            "results.sensitivity",
            "prediction.budget",
        ),
        "Folders that are left": ("results.run_folder", "experiments.study_folder", "results.problem_folder"),
        "Write a command, a report, workers": (
            "commands",
            "rendering",
            "rendering.content",
            "rendering.wording",
            "rendering.result",
            "experiments.workers",
            "benchmark.methods",
        ),
        "Errors": ("support.errors",),
    },
}
"""Modules that a user of the packages meets, by what one wants."""
HEADS = {
    "ident": "Recordings in, gains out; never a simulator. What most need is exported by `ident` itself.",
    "sim": "The simulated robot cell. Nothing is exported by `sim` itself: import from the modules below.",
    "scenarios": "Declarative experiments. What most need is exported by `scenarios` itself.",
}


def api_pages() -> dict[str, str]:
    """The pages by their places."""
    return {f"reference/{package}.md": _page(package) for package in MODULES}


def _page(package: str) -> str:
    text = f"# `{package}`\n\n{HEADS[package]}\n"
    for title, modules in MODULES[package].items():
        text += f"\n## {title}\n"
        for module in modules:
            text += f"\n::: {package}.{module}\n"
    return text
