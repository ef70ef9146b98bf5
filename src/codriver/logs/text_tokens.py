"""Words of text lines as columns: what the text formats of CAN traces have in common.

A block of text is cut at white space once, for all lines together. A line is then a run of words, and "the third word
of every line" is an array of word numbers, which the methods here read as numbers, a column at a time, with a flag for
each that could be read. Nothing here raises: what is no number has its flag unset.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Index = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

# Text parsed at a time, bytes: little enough that its words stay in the cache.
_BLOCK = 1 << 19
_NO_DIGIT = 255
_HEX = np.full(256, _NO_DIGIT, np.uint8)
for _characters, _first in ((b"0123456789", 0), (b"abcdef", 10), (b"ABCDEF", 10)):
    _HEX[list(_characters)] = np.arange(len(_characters)) + _first
_DECIMAL = np.where(_HEX < 10, _HEX, _NO_DIGIT).astype(np.uint8)


def blocks(content: bytes) -> Iterator[bytes]:
    """The text in blocks of whole lines."""
    start = 0
    while start < len(content):
        stop = content.rfind(b"\n", start, start + _BLOCK) + 1
        if stop <= 0:  # one line longer than a block
            stop = content.find(b"\n", start) + 1 or len(content)
        if len(content) - start <= _BLOCK:
            stop = len(content)
        yield content[start:stop]
        start = stop


@dataclass(frozen=True, eq=False)
class Words:
    """The words of a block of text.

    Attributes:
        text: the block, uint8, with spaces behind.
        start, stop: bounds of each word in the text, shape (words,).
        first: the number of the first word of each line that has any, shape (lines,).
        count: how many words each of these lines has, shape (lines,).
    """

    text: npt.NDArray[np.uint8]
    start: Index
    stop: Index
    first: Index
    count: Index

    @classmethod
    def of(cls, block: bytes) -> Words:
        """The words of a block."""
        # Spaces behind the text let fixed-size windows reach beyond its end.
        text = np.frombuffer(block + b" " * 64, np.uint8)
        dark = text > 32
        edges = np.flatnonzero(dark[1:] != dark[:-1]) + 1
        if dark[0]:
            edges = np.concatenate([[0], edges])
        start, stop = edges[::2], edges[1::2]
        line_ends = np.flatnonzero(text == 10)
        bounds = np.searchsorted(start, np.concatenate([[0], line_ends, [text.size]]))
        count = np.diff(bounds)
        full = count > 0
        return cls(text, start, stop, bounds[:-1][full], count[full])

    def __len__(self) -> int:
        """The number of lines that have words."""
        return self.first.size

    def word(self, lines: Index, k: Index | int) -> Index:
        """The k-th word of each of the lines; the last word of the block stands in where a line is shorter."""
        return np.minimum(self.first[lines] + k, self.start.size - 1)

    def line(self, line: int) -> str:
        """The text of a line, for an error message."""
        first, last = self.first[line], self.first[line] + self.count[line] - 1
        return self.text[self.start[first] : self.stop[last]].tobytes().decode("latin-1")

    def begins(self, words: Index, with_: bytes) -> Flags:
        """Which words begin with these characters, in upper or lower case."""
        start = self.start[words]
        same = self.stop[words] - start >= len(with_)
        for k, character in enumerate(with_):
            if not same.any():
                break
            same &= (self.text[start + k] | 32) == (character | 32)
        return same

    def equals(self, words: Index, text: bytes) -> Flags:
        """Which words are these characters, in upper or lower case."""
        return self.begins(words, text) & (self.stop[words] - self.start[words] == len(text))

    def integers(self, words: Index, base: int, *, cut: Index | int = 0, most: int = 10) -> tuple[Index, Flags]:
        """Words as whole numbers without sign, in base 10 or 16.

        Args:
            words: word numbers, shape (n,).
            base: 10 or 16.
            cut: characters at the end of each word that are no part of the number, shape (n,) or one for all.
            most: characters at most; a longer word is no number.
        """
        return self.integers_between(self.start[words], self.stop[words] - cut, base, most=most)

    def integers_between(self, start: Index, stop: Index, base: int, *, most: int = 10) -> tuple[Index, Flags]:
        """Whole numbers between places in the text; see `integers`."""
        table = _HEX if base == 16 else _DECIMAL
        length = stop - start
        ok = (length > 0) & (length <= most)
        values = np.zeros(start.size, np.int64)
        for k in range(int(length[ok].max(initial=0))):
            inside = k < length
            digit = table[self.text[np.where(inside, start + k, start)]]
            values = np.where(inside, values * base + digit, values)
            ok &= ~inside | (digit != _NO_DIGIT)
        return values, ok

    def numbers(self, words: Index) -> tuple[npt.NDArray[np.float64], Flags]:
        """Words as decimal numbers such as "12" or "12.3456", exact to the last bit up to 15 digits."""
        return self.numbers_between(self.start[words], self.stop[words])

    def numbers_between(self, start: Index, stop: Index) -> tuple[npt.NDArray[np.float64], Flags]:
        """Decimal numbers between places in the text; see `numbers`."""
        length = stop - start
        values = np.zeros(start.size)
        ok = np.zeros(start.size, bool)
        # By length: words of one length are a matrix of characters.
        for size in np.unique(length).tolist():
            if not 0 < size <= 24:
                continue
            which = np.flatnonzero(length == size)
            mantissa = np.zeros(which.size)
            decimals = np.zeros(which.size, np.int64)
            dots = np.zeros(which.size, np.int64)
            good = np.ones(which.size, bool)
            for k in range(size):
                character = self.text[start[which] + k]
                digit = _DECIMAL[character]
                dot = character == ord(".")
                good &= dot | (digit != _NO_DIGIT)
                mantissa = np.where(dot, mantissa, mantissa * 10.0 + digit)
                decimals += np.where(dot, 0, dots)
                dots += dot
            # Two exact numbers divided are rounded once: the float that the text stands for.
            values[which] = mantissa / 10.0**decimals
            ok[which] = good & (dots <= 1) & (dots < size)
        return values, ok

    def bytes_of(self, words: Index, base: int = 16) -> tuple[npt.NDArray[np.uint8], Flags]:
        """Words as bytes: one or two hexadecimal digits, or up to three decimal ones."""
        if base == 10:
            values, ok = self.integers(words, base, most=3)
            return values.astype(np.uint8), ok & (values < 256)
        start = self.start[words]
        two = self.stop[words] - start == 2
        if two.all():
            return self.bytes_at(start)
        values, ok = self.integers(words, base, most=2)
        return values.astype(np.uint8), ok

    def bytes_at(self, place: Index) -> tuple[npt.NDArray[np.uint8], Flags]:
        """Two hexadecimal digits at places in the text, as a byte."""
        high, low = _HEX[self.text[place]], _HEX[self.text[place + 1]]
        return (high * np.uint8(16)) | (low & np.uint8(15)), (high != _NO_DIGIT) & (low != _NO_DIGIT)
