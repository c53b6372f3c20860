"""What mkdocs asks for while it builds the site: pages made from the code, and equations set as MathML."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]  # mkdocs imports this file by its path

from api import api_pages  # noqa: E402
from command_pages import commands_page  # noqa: E402
from equations import typeset  # noqa: E402
from key_pages import key_pages  # noqa: E402
from mkdocs.config.defaults import MkDocsConfig  # noqa: E402
from mkdocs.structure.files import File, Files  # noqa: E402
from mkdocs.structure.pages import Page  # noqa: E402
from notebook import notebook_page  # noqa: E402


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that nobody writes."""
    notebook = {"tutorial/python.md": notebook_page(ROOT / "examples" / "case.py")}
    for place, text in ({"reference/commands.md": commands_page()} | notebook | key_pages() | api_pages()).items():
        files.append(File.generated(config, place, content=text))
    return files


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Name the dialog of the theme's search."""
    return output.replace('role="dialog"', 'role="dialog" aria-label="Search"')


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Set the equations of a page."""
    return typeset(html)
