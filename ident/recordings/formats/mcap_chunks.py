"""Messages of MCAP files chunk by chunk, as arrays of bytes: their indexes say where in a chunk each message is.

The container is read by `rosbags`; only its walk from message to message is not used, which takes some 5 us each.
"""

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

import numpy as np

from ident.support.arrays import Indices

if TYPE_CHECKING:
    from rosbags.rosbag2.storage_mcap import ChunkInfo, McapReader

MESSAGE, INDEX = 5, 7
"""First bytes of records."""
RECORD, MESSAGE_HEAD, INDEX_HEAD = 9, 22, 15
"""Bytes before the content of a record; of a message before its data; of an index before its entries."""
LARGEST_CHUNK = 1_000_000_000
"""Bytes of an unpacked chunk; writers begin a new one after some megabytes."""


class DamagedChunk(ValueError):
    """A chunk whose index does not fit it."""


def has_indexes(storage: "McapReader", channels: Collection[int]) -> bool:
    """Whether every message of some channels can be found by an index.

    Args:
        storage: An open file.
        channels: Numbers of the channels.
    """
    counts = storage.statistics.channel_message_counts if storage.statistics else {}
    indexed = sum(chunk.channel_count.get(channel, 0) for chunk in storage.chunks for channel in channels)
    return bool(storage.chunks) and indexed == sum(counts.get(channel, -1) for channel in channels)


def chunk_messages(storage: "McapReader", channels: Collection[int]) -> Iterator[tuple[Indices, np.ndarray]]:
    """Messages of some channels, those of one length in one chunk at a time.

    Args:
        storage: An open file with indexes.
        channels: Numbers of the channels.

    Yields:
        Times of logging [ns], shape (k,), and bytes, one message a row, shape (k, length).

    Raises:
        DamagedChunk: If an index points to something else than messages of its channel.
    """
    for chunk in storage.chunks:
        wanted = [channel for channel in channels if channel in chunk.message_index_offsets]
        if not wanted:
            continue
        data = np.frombuffer(_unpacked(storage, chunk), dtype=np.uint8)
        for channel in wanted:
            yield from _messages(data, channel, _index(storage, chunk.message_index_offsets[channel], channel))


def _unpacked(storage: "McapReader", chunk: "ChunkInfo") -> bytes:
    from rosbags.rosbag2.storage_mcap import decompress, read_exact

    assert storage.bio is not None
    if chunk.uncompressed_size > LARGEST_CHUNK:
        raise DamagedChunk(f"a chunk of {chunk.uncompressed_size / 1e6:.4g} MB")
    storage.bio.seek(chunk.chunk_start_offset + RECORD + 24)
    crc = int.from_bytes(read_exact(storage.bio, 4), "little")
    storage.bio.seek(chunk.chunk_start_offset + RECORD + 40 + len(chunk.compression))
    packed = read_exact(storage.bio, chunk.compressed_size)
    return decompress(packed, chunk.compression, chunk.uncompressed_size, crc)


def _index(storage: "McapReader", offset: int, channel: int) -> np.ndarray:
    """Time of logging and place in the chunk of each message, shape (k, 2)."""
    from rosbags.rosbag2.storage_mcap import read_exact

    assert storage.bio is not None
    storage.bio.seek(offset)
    head = read_exact(storage.bio, INDEX_HEAD)
    size = int.from_bytes(head[11:], "little")
    if head[0] != INDEX or int.from_bytes(head[9:11], "little") != channel or size % 16:
        raise DamagedChunk("an index is not where it should be")
    return np.frombuffer(read_exact(storage.bio, size), dtype="<u8").reshape(-1, 2)


def _messages(data: np.ndarray, channel: int, index: np.ndarray) -> Iterator[tuple[Indices, np.ndarray]]:
    times, places = index[:, 0].astype(np.intp), index[:, 1].astype(np.intp)
    if not len(places):
        return
    if places.min() < 0 or places.max() + RECORD + MESSAGE_HEAD > len(data):
        raise DamagedChunk("an index points beyond its chunk")
    heads = _at(data, places, RECORD + 2)  # what it is, its size, its channel
    sizes = np.ascontiguousarray(heads[:, 1:9]).view("<u8")[:, 0]
    if (heads[:, 0] != MESSAGE).any() or (np.ascontiguousarray(heads[:, 9:]).view("<u2") != channel).any():
        raise DamagedChunk("an index points to no message of its channel")
    for size in np.unique(sizes).tolist():
        own = sizes == size
        if size < MESSAGE_HEAD or size > len(data) or places[own].max() + RECORD + size > len(data):
            raise DamagedChunk("a message reaches beyond its chunk")
        if size > MESSAGE_HEAD:
            yield times[own], _at(data, places[own] + RECORD + MESSAGE_HEAD, size - MESSAGE_HEAD)


def _at(data: np.ndarray, places: np.ndarray, size: int) -> np.ndarray:
    """Bytes from some places on, shape (k, size)."""
    return np.lib.stride_tricks.sliding_window_view(data, size)[places]
