"""Pictures of a scene as a file: PNG, GIF or MP4, by its ending."""

from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ident.support.arrays import Array
from ident.support.naming import needed_extra
from scenarios.support.errors import ScenarioError

CAPTION = 0.02
"""Height of the caption's letters, relative to the picture's width."""


def captioned(picture: Array, text: str) -> Image.Image:
    """Return a picture (height, width, 3) with a line of text in its upper left corner, scaled to fit."""
    image = Image.fromarray(np.asarray(picture, dtype=np.uint8))
    draw, size = ImageDraw.Draw(image), CAPTION * image.width
    length = draw.textlength(text, font=ImageFont.load_default(size))
    font = ImageFont.load_default(size * min(1.0, 0.95 * image.width / length))
    where = 0.02 * image.width, 0.02 * image.height
    draw.text(where, text, fill=(20, 22, 25), font=font, stroke_width=1, stroke_fill=(240, 242, 245))
    return image


def write_png(path: Path, images: Iterator[Image.Image], fps: float) -> None:
    """Write the first picture."""
    next(images).save(path, format="PNG")


def write_gif(path: Path, images: Iterator[Image.Image], fps: float) -> None:
    """Write all pictures as a repeating GIF."""
    first = next(images)
    first.save(path, format="GIF", save_all=True, append_images=images, duration=1000.0 / fps, loop=0, optimize=False)


def write_mp4(path: Path, images: Iterator[Image.Image], fps: float) -> None:
    """Write all pictures as a film in H.264.

    Raises:
        ScenarioError: If the library is not installed.
    """
    missing = [name for name in ("imageio", "imageio_ffmpeg") if find_spec(name) is None]
    if missing:
        raise ScenarioError(f"{path}: {needed_extra(missing[0])}; PNG and GIF do not need it")
    imageio = import_module("imageio.v3")
    pixels = np.stack([np.asarray(image) for image in images])
    imageio.imwrite(path, pixels, extension=".mp4", fps=fps, macro_block_size=2)


WRITERS: dict[str, Callable[[Path, Iterator[Image.Image], float], None]] = {
    ".png": write_png,
    ".gif": write_gif,
    ".mp4": write_mp4,
}
"""Functions that write files, by the ending of the name."""


def frames(duration: float, fps: float) -> Sequence[float]:
    """Return the times of the pictures of a film [s], from its start."""
    return tuple(np.arange(0.0, duration, 1.0 / fps).tolist())
