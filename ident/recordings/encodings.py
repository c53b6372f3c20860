"""Numbers of registers that were logged as read: sign and magnitude, or two's complement taken for unsigned.

A servo's load register has the direction in one bit above the magnitude; a 16-bit register read as unsigned shows small
negative numbers below 65536. Either way the column jumps by a power of two where the quantity crosses zero; decoded, it
does not. A column that crosses that power of two itself does the opposite.
"""

import numpy as np

from ident.support.arrays import Array

SIGN_BITS, WORDS = range(7, 31), (8, 16, 32)
"""Bits that may hold a sign, and lengths of words [bits]."""
LESS = 0.5
"""Largest size of the steps across zero of a decoded column, relative to those as logged."""


def decoded(x: Array, sign_bit: float = 0.0, bits: float = 0.0) -> Array:
    """Return register values as numbers, shape (N,).

    Args:
        x: Values as logged.
        sign_bit: Bit that is set for negative numbers, from 0, beside the magnitude; 0 for none.
        bits: Length of a word in two's complement that was read as unsigned; 0 if it was not.
    """
    if sign_bit:
        negative = np.floor(x / 2.0**sign_bit) % 2.0 == 1.0
        return np.where(negative, 2.0**sign_bit - x, x)
    return np.where(x >= 2.0 ** (bits - 1.0), x - 2.0**bits, x) if bits else x


def likely_encoding(x: Array) -> str:
    """Return the key and value that make a column of registers continuous, such as `sign_bit = 10`; empty for none."""
    if not len(x) or x.min() < 0.0 or (x != np.rint(x)).any():
        return ""
    largest, step = float(x.max()), np.abs(np.diff(x))
    for key, values in (("sign_bit", SIGN_BITS), ("bits", WORDS)):
        for value in values:
            most = 2.0 ** (value + (key == "sign_bit"))
            if 0.5 * most <= largest < most:
                across = np.diff(x >= 0.5 * most)  # the sign changes
                after = np.abs(np.diff(decoded(x, **{key: value})))
                if float(after[across].sum()) < LESS * float(step[across].sum()):
                    return f"{key} = {value}"
    return ""
