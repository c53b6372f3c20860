"""Commands that show what is there: `rx90 list`, `view`, `report` and `schema`."""

import argparse
import os
import sys
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ident.support.naming import needed_extra, one_line
from scenarios.command_line import arguments, output
from scenarios.command_line.process import Status, with_opengl, write
from scenarios.experiments.scenario_files import builtin_names, scenario_table
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.support.arrays import Array

ENDINGS = (".png", ".gif", ".mp4")
WIDTH = arguments.count_from(64, 4096, "larger pictures are slow to render")
FPS = 8.0
"""Frames per second of a film."""
PAGE = "report.html"


def list_command(options: argparse.Namespace) -> Status:
    """List every built-in scenario with its description."""
    described = {name: str(scenario_table(name)[0].get("description", "")) for name in builtin_names()}
    if output.form(options) != "text":
        from scenarios.results.written import ListedScenarios

        return output.show(ListedScenarios.of(described).report("Built-in scenarios"), options)
    _write_listed(described)
    return Status.PASSED


def _write_listed(described: Mapping[str, str]) -> None:
    """Write names and descriptions, without the imports of a report."""
    indent = max(map(len, described)) + 2
    for name, description in described.items():
        line = f"{name:<{indent}}{description}"
        write(textwrap.fill(line, output.page().width or len(line), subsequent_indent=" " * indent) + "\n")


def view_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, and file and size of the picture."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    text = "render to a file: PNG, GIF or MP4 by its ending"
    add("--render", "--out", type=arguments.file, metavar="FILE", help=text)
    add("--at", type=arguments.not_negative, metavar="T", help="time of a PNG [s] (default half of the motion)")
    add("--width", type=WIDTH, default=640, metavar="N", help="pixels (default 640)")
    output.add_force_argument(parser)


def view_command(options: argparse.Namespace) -> Status:
    """Show all motions of a scenario, side by side."""
    path: Path | None = options.render
    with_opengl()
    if path is not None and sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl")  # MuJoCo selects a window system at import unless this is set
    import OpenGL  # noqa: F401 # pyright: ignore[reportUnusedImport] # without it MuJoCo has no renderer

    try:
        import mujoco  # noqa: F401 # pyright: ignore[reportUnusedImport] # reads MUJOCO_GL
    except (ImportError, AttributeError, RuntimeError) as error:  # errors of the libraries below it
        from sim.errors import ADVICE, PlantError

        backend = f"MUJOCO_GL={os.environ.get('MUJOCO_GL', '')}"
        raise PlantError(f"{backend}: this OpenGL backend is not available ({error}); {ADVICE}") from error
    import numpy as np

    from scenarios.experiments.scenario import load_scenario, setup_of
    from scenarios.rendering.wording import many
    from scenarios.support.progress import counted
    from sim.viewer import pictures, scene, watch

    if path is not None and path.suffix.lower() not in ENDINGS:
        raise ScenarioError(f"{path}: unknown ending {path.suffix!r}; known: {', '.join(ENDINGS)}")
    motions = setup_of(load_scenario(options.scenario)).experiments
    duration = max(motion.trajectory.duration for motion in motions)
    if options.at is not None and options.at > duration:
        raise ScenarioError(f"--at {options.at:g} s: the motion ends at {duration:g} s; name a time up to that")
    if path is None:
        watch(scene(motions))
        return Status.PASSED
    claim = output.right_to_write(options, path, command="rx90 view")
    times: Sequence[float] = np.arange(0.0, duration, 1.0 / FPS).tolist()
    if path.suffix.lower() == ".png":
        times = (0.5 * duration if options.at is None else options.at,)
    shown, width = scene(motions, times), options.width
    height = shown.height(width)
    drawn = pictures(shown, times, width=width, height=height)
    with claim.writing(), output.under_way(options, "drawing") as stages:
        stages.begin("drawing", len(times))
        write_pictures(path, counted(drawn, stages))
    names = ", ".join(motion.name for motion in motions)
    write(f"{one_line(path)}: {many(len(times), 'picture')} of {width} x {height}, from left: {names}\n")
    return Status.PASSED


def write_pictures(path: Path, drawn: "Iterator[Array]") -> None:
    """Write a PNG of the first picture, a repeating GIF or, if its library is there, a film, by the name's ending."""
    import numpy as np
    from PIL import Image

    images = (Image.fromarray(picture.astype("uint8")) for picture in drawn)
    match path.suffix.lower():
        case ".png":
            next(images).save(path, format="PNG")
        case ".gif":
            first, more = next(images), {"loop": 0, "optimize": False}
            first.save(path, format="GIF", save_all=True, append_images=images, duration=1000.0 / FPS, **more)
        case _:
            missing = [name for name in ("imageio", "imageio_ffmpeg") if find_spec(name) is None]
            if missing:
                raise ScenarioError(f"{path}: {needed_extra(missing[0])}; PNG and GIF do not need it")
            pixels = np.stack([np.asarray(image) for image in images])
            import_module("imageio.v3").imwrite(path, pixels, extension=".mp4", fps=FPS, macro_block_size=2)


def report_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare folder and page."""
    add = parser.add_argument
    text = "folder written by run, identify or check --save, or by monte-carlo, sensitivity, compare or paper --out"
    add("folder", metavar="DIR", type=arguments.folder, help=text)
    add("--out", type=arguments.file, metavar="FILE", help=f"the page (default DIR/{PAGE})")
    add("--no-picture", action="store_true", help="omit the picture of the arm, which takes seconds to render")
    output.add_force_argument(parser)


def report_command(options: argparse.Namespace) -> Status:
    """Write a saved result as a page."""
    from scenarios.rendering import Page, renderer
    from scenarios.results.pages import page_of, with_picture

    path: Path = options.out or options.folder / PAGE
    claim = output.right_to_write(options, path, command="rx90 report")
    with output.under_way(options, "drawing"):
        report = page_of(options.folder)
        report = report if options.no_picture else with_picture(report, options.folder)
        content = renderer("html")(report, Page()).encode(errors="backslashreplace")
    with claim.writing():
        path.write_bytes(content)
    write(f"{path}: {len(content) / 1e6:.2f} MB, open it in any browser\n")
    return Status.PASSED


def schema_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the name of the schema."""
    from scenarios.results.json_schemas import FILES, RESULTS

    text = "schema of a file or of a command's --json output (default: list all)"
    parser.add_argument("name", nargs="?", metavar="NAME", choices=list(FILES | RESULTS), help=text)


def schema_command(options: argparse.Namespace) -> Status:
    """Print a schema, or list all of them."""
    import json

    from scenarios.results.json_schemas import FILES, RESULTS, schema
    from scenarios.support.texts import FOLDER

    if options.name is None:
        _write_listed({name: str(schema(name)["description"]).partition("\n")[0] for name in FILES | RESULTS})
        write(f"\nrx90 schema NAME prints one; those of TOML files are also in {FOLDER}\n")
    else:
        write(json.dumps(schema(options.name), indent=2) + "\n")
    return Status.PASSED
