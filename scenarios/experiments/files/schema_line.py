"""The line by which a TOML file names its JSON Schema: `#:schema PLACE`.

Taplo, and editors that use it, complete and check keys by it.
"""

from pathlib import Path

FOLDER = Path(__file__).parents[2] / "schemas"
"""Where the schemas lie, in the package."""
ENDING = ".schema.json"


def schema_line(name: str) -> str:
    """The first line of a file that is written for a user, wherever that is.

    Args:
        name: Of the schema: scenario, payload or motion.
    """
    return f"#:schema {(FOLDER / f'{name}{ENDING}').as_uri()}"
