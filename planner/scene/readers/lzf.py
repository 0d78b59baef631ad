"""LZF decompression, compiled: the format of binary_compressed PCD files."""

import numpy as np

from planner.geometry.arrays import Bytes
from planner.geometry.compiled import compiled


@compiled
def unpack(packed: Bytes, size: int) -> tuple[Bytes, int]:
    """Unpack an LZF stream.

    A control byte below 32 announces that many plus one literal bytes; otherwise its upper three
    bits are the length less two of a copy (7: the next byte adds to it), and its lower five with
    the next byte the distance less one back to it.

    Parameters
    ----------
    packed
        The stream, shape (P,).
    size
        Bytes that it should give.

    Returns
    -------
    block
        Shape (size,).
    length
        Bytes that it really gave; -1 if the stream is damaged.

    """
    block = np.zeros(size, dtype=np.uint8)
    at = out = 0
    while at < len(packed):
        control = int(packed[at])
        at += 1
        if control < 32:
            length = control + 1
            if at + length > len(packed) or out + length > size:
                return block, -1
            for i in range(length):
                block[out + i] = packed[at + i]
            at += length
        else:
            length = control >> 5
            if length == 7:
                if at >= len(packed):
                    return block, -1
                length += int(packed[at])
                at += 1
            if at >= len(packed):
                return block, -1
            back = out - ((control & 31) << 8) - int(packed[at]) - 1
            at += 1
            length += 2
            if back < 0 or out + length > size:
                return block, -1
            for i in range(length):
                block[out + i] = block[back + i]
        out += length
    return block, out
