"""`rx90 view`."""

import argparse
import os
import sys

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status, printable, with_opengl
from scenarios.support.errors import ScenarioError
from sim.errors import ADVICE, NoPicture

WIDTH = arguments.count_from(64, 4096, "larger pictures are slow to render")
FPS = arguments.number_from(1.0, 60.0, "1/s", "outside the useful range of frame rates")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    said = "render to a file: PNG, GIF or MP4 by its ending"
    add("--render", "--out", type=arguments.file, metavar="FILE", help=said)
    add("--at", type=arguments.not_negative, metavar="T", help="time of a PNG [s] (default half of the motion)")
    add("--width", type=WIDTH, default=640, metavar="N", help="pixels (default 640)")
    add("--height", type=WIDTH, metavar="N", help="pixels (default: as many as the arms need)")
    add("--fps", type=FPS, default=8.0, metavar="X", help="frames per second of a GIF or MP4 (default 8)")
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Show all motions of a scenario, side by side."""
    with_opengl()
    if options.render is not None and sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl")  # MuJoCo selects a window system at import unless this is set
    _check_opengl()
    from scenarios.command_line.writing import right_to_write
    from scenarios.experiments.scenario import load_scenario, setup_of
    from scenarios.rendering.film import WRITERS, captioned, frames
    from scenarios.results.written import Written
    from scenarios.support.progress import counted
    from sim.viewer import pictures, scene, watch

    path = options.render
    if path is not None and path.suffix.lower() not in WRITERS:
        raise ScenarioError(f"{path}: unknown ending {path.suffix!r}; known: {', '.join(WRITERS)}")
    setup = setup_of(load_scenario(options.scenario))
    motions = setup.experiments
    duration = max(motion.trajectory.duration for motion in motions)
    if options.at is not None and options.at > duration:
        raise ScenarioError(f"--at {options.at:g} s: the motion ends at {duration:g} s; name a time up to that")
    if path is None:
        watch(scene(motions))
        return Status.PASSED
    held = right_to_write(options, path.parent, [path.name], command="rx90 view")
    times = frames(duration, options.fps)
    if path.suffix.lower() == ".png":
        times = (0.5 * duration if options.at is None else options.at,)
    shown, width = scene(motions, times), options.width
    height = shown.height(width) if options.height is None else options.height
    drawn = pictures(shown, times, width=width, height=height)
    names = ", ".join(experiment.name for experiment in motions)
    labelled = (
        captioned(picture, f"{setup.scenario.name}, from left: {names}; {t:.1f} s")
        for t, picture in zip(times, drawn, strict=True)
    )
    with held.writing(), under_way(options, "drawing") as stages:
        stages.begin("drawing", len(times))
        WRITERS[path.suffix.lower()](path, counted(labelled, stages), options.fps)
    said = f"{path}: {len(times)} picture{'s' if len(times) > 1 else ''} of {width} x {height}"
    more = {"pictures": len(times), "width": width, "height": height}
    result = Written.model_validate({"out": str(path), **more})
    show(result.report(printable(said)), options)
    return Status.PASSED


def _check_opengl() -> None:
    """Import MuJoCo, which reads MUJOCO_GL at import, and without OpenGL's Python package has no renderer."""
    import OpenGL  # noqa: F401 # pyright: ignore[reportUnusedImport]

    try:
        import mujoco  # noqa: F401 # pyright: ignore[reportUnusedImport]
    except (ImportError, AttributeError, RuntimeError) as error:  # errors of the libraries below it
        raise NoPicture(
            f"MUJOCO_GL={os.environ.get('MUJOCO_GL', '')}: this OpenGL backend is not available ({error}); {ADVICE}"
        ) from error
