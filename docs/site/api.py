"""Pages of what can be imported, for mkdocstrings to fill from the docstrings."""

MODULES = {
    "ident": {
        "Identify": ("identification", "options", "observation", "estimate", "gain_comparison"),
        "Read": ("recording", "recording_files", "payload", "payload_files", "arm", "structure"),
        "Use the gains": ("known_gains", "joint_torque", "weighing.verification", "weighing.together", "bare"),
        "Look at logs": ("check", "preparation", "diagnosis.diagnosis", "logs.columns", "logs.description"),
        "Write an estimator": ("estimators", "problem", "rows", "conclusion", "joint_fit", "uncertainty", "prediction"),
        "Mathematics": ("regressor", "base", "parameters", "signals", "least_squares"),
        "Errors": ("errors",),
    },
    "sim": {
        "Plant": ("plant", "drives", "robot", "robot_files"),
        "Record": ("record", "experiment", "sequence", "trajectory", "controller", "sensors"),
        "Write an effect or a sensor": ("effects", "effects.effect", "sensors.effect"),
        "Errors": ("errors",),
    },
    "scenarios": {
        "Run": ("run", "judge", "assertions", "build", "trials"),
        "Read and change scenarios": ("files.loading", "files.schema", "files.motions", "files.gains"),
        "Studies": ("studies.monte_carlo", "studies.sensitivity", "studies.statistics", "studies.calibration"),
        "Folders that are left": ("store.run_folder", "store.study_folder", "store.problem_folder"),
        "Write a command, a report, workers": (
            "commands",
            "reports.content",
            "reports.renderers",
            "workers.kinds",
            "methods.method",
        ),
        "Errors": ("errors",),
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
