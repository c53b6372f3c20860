"""Text of a log file: unpacked, in UTF-8, without byte order mark, comments as blank lines."""

import re
import zlib
from pathlib import Path

from ident.support.errors import RecordingError
from ident.support.file_access import read_bytes
from ident.support.naming import one_line

LARGEST = 500_000_000
"""Largest size of a text [bytes]: two million samples of six joints with all digits."""
MARKS = ((b"\xff\xfe\x00\x00", "utf-32"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8"))
"""Byte order marks; spreadsheets write them."""
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
_COMMENT = re.compile(rb"#[^\r\n]*")


def read_text(path: Path, encoding: str | None = None) -> bytes:
    """Return the text of a file, as UTF-8 or another superset of ASCII.

    Args:
        path: The file.
        encoding: Encoding; from its byte order mark if None.

    Raises:
        RecordingError: If it cannot be read or is not text.
    """
    content = read_bytes(path, most_bytes=LARGEST, error=RecordingError)
    if content.startswith(b"\x1f\x8b"):
        content = _unpacked(path, content)
    if encoding is not None:
        content = _decoded(path, content, encoding)
    for mark, marked in MARKS:
        if content.startswith(mark):
            if marked == "utf-8":
                content = content[len(mark) :]
                break
            content = _decoded(path, content, marked)
            break
    if _CONTROL.search(content[:100_000]):
        hint = "is it UTF-16? save it as UTF-8" if 2 * content[:100].count(0) >= len(content[:100]) - 1 else ""
        raise RecordingError(
            f"{one_line(path)}: not a text file; {hint or 'expected CSV, or a name ending in .parquet'}"
        )
    return content


def without_comments(content: bytes) -> bytes:
    """Return the text without comments from `#` to the end of a line; line numbers stay the same."""
    return _COMMENT.sub(b"", content) if b"#" in content else content


def _decoded(path: Path, content: bytes, encoding: str) -> bytes:
    try:
        return content.decode(encoding).encode()
    except UnicodeError as error:
        place = f" at byte {error.start}" if isinstance(error, UnicodeDecodeError) else ""
        raise RecordingError(f"{one_line(path)}: broken {encoding.upper()}{place}") from error


def _unpacked(path: Path, content: bytes) -> bytes:
    text, room = list[bytes](), LARGEST + 1
    while content := content.lstrip(b"\0"):  # concatenated members, as from `cat a.gz b.gz`
        unpacker = zlib.decompressobj(wbits=31)
        try:
            text.append(unpacker.decompress(content, room))
        except zlib.error as error:
            raise RecordingError(f"{one_line(path)}: not a readable gzip file ({one_line(error)})") from error
        room -= len(text[-1])
        if room <= 0:
            raise RecordingError(f"{one_line(path)}: more than {LARGEST / 1e6:g} MB unpacked; take a part of it")
        if not unpacker.eof:
            raise RecordingError(f"{one_line(path)}: the gzip file is cut off")
        content = unpacker.unused_data
    return b"".join(text)
