"""`<include file="..."/>` of MJCF files, replaced by what the files hold."""

from dataclasses import replace
from pathlib import Path

from ident.model.files.xml_tree import DEEPEST, LARGEST, Element, read_xml
from ident.support.errors import RobotModelError
from ident.support.naming import shown


def included(root: Element, path: Path) -> Element:
    """The tree with every include replaced by the children of the file's outermost element.

    Args:
        root: Outermost element of the main file.
        path: The main file; names are relative to its folder.

    Raises:
        RobotModelError: If an included file cannot be read, is included twice, or all are too large together.
    """
    return _expanded(root, path.parent, {path.resolve(): path.stat().st_size}, DEEPEST)


def _expanded(element: Element, folder: Path, sizes: dict[Path, int], room: int) -> Element:
    children = [found for child in element.children for found in _resolved(child, folder, sizes, room - 1)]
    return replace(element, children=children)


def _resolved(element: Element, folder: Path, sizes: dict[Path, int], room: int) -> list[Element]:
    """The element itself, or what stands in the place of an include."""
    if room <= 0:
        raise RobotModelError(f"{element.where}: with what is included, elements are nested deeper than {DEEPEST}")
    if element.tag != "include":
        return [_expanded(element, folder, sizes, room)]
    inside = _content(element, folder, sizes).children
    return [found for child in inside for found in _resolved(child, folder, sizes, room - 1)]


def _content(include: Element, folder: Path, sizes: dict[Path, int]) -> Element:
    name = include.attributes.get("file", "")
    if not name:
        raise RobotModelError(f"{include.where}: include names no file")
    path = folder / name
    if path.resolve() in sizes:
        raise RobotModelError(f"{include.where}: include file = {shown(name)} is there already")
    try:
        content = read_xml(path)
    except RobotModelError as error:
        raise RobotModelError(f"{include.where}: include: {error}") from error
    sizes[path.resolve()] = path.stat().st_size
    if sum(sizes.values()) > LARGEST:
        raise RobotModelError(f"{include.where}: more than {LARGEST / 1e6:g} MB are included")
    return content
