"""CAN messages as layouts of bits: numbers to payloads, column-wise, and the DBC text that says how to read them back.

A signal's raw integer is round((value - offset) / factor), held within what its bits can say, in two's complement if
signed. Bit positions are those of a DBC: bit b of byte B is 8 B + b. Intel signals start at their least significant
bit and go up; Motorola signals start at their most significant bit and go down within a byte, then on with bit 7 of
the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from codriver.signals.signal import Array


@dataclass(frozen=True)
class Field:
    """One signal of a message.

    Attributes:
        name: in the DBC.
        sensor: name for `Instruments.read`; "" for the message counter.
        start: start bit, as a DBC counts.
        length: bits.
        factor, offset: value = factor * raw + offset, in `unit`.
        unit: as the DBC spells it.
        to_unit: the unit's value per SI unit of the sensor.
        signed, motorola: how the bits are laid.
        comment: for the DBC.
    """

    name: str
    sensor: str
    start: int
    length: int
    factor: float = 1.0
    offset: float = 0.0
    unit: str = ""
    to_unit: float = 1.0
    signed: bool = False
    motorola: bool = False
    comment: str = ""

    @property
    def raw_range(self) -> tuple[int, int]:
        """Least and greatest raw integer."""
        return (-(1 << self.length - 1), (1 << self.length - 1) - 1) if self.signed else (0, (1 << self.length) - 1)

    def bits(self) -> list[tuple[int, int]]:
        """(byte, bit) of each bit, least significant first."""
        if not self.motorola:
            return [divmod(self.start + i, 8) for i in range(self.length)]
        places, at = [], self.start
        for _ in range(self.length):
            places.append(divmod(at, 8))
            at = at + 15 if at % 8 == 0 else at - 1
        return places[::-1]


@dataclass(frozen=True)
class Message:
    """One CAN message.

    Attributes:
        name: in the DBC.
        identifier: 11 bits.
        rate: frames per second.
        length: payload, bytes.
        fields: the signals.
        sender: node in the DBC.
    """

    name: str
    identifier: int
    rate: float
    length: int
    fields: tuple[Field, ...]
    sender: str


def encode(message: Message, columns: Mapping[str, Array]) -> npt.NDArray[np.uint8]:
    """Payloads of many frames of a message, shape (n, message.length).

    Args:
        message: the layout.
        columns: by field name, values in the field's unit, each of shape (n,).
    """
    count = len(next(iter(columns.values())))
    payload = np.zeros((count, message.length), dtype=np.uint8)
    for field in message.fields:
        low, high = field.raw_range
        raw = np.clip(np.rint((columns[field.name] - field.offset) / field.factor), low, high).astype(np.int64)
        for i, (byte, bit) in enumerate(field.bits()):
            payload[:, byte] |= (((raw >> i) & 1) << bit).astype(np.uint8)
    return payload


def dbc_text(messages: tuple[Message, ...], version: str) -> str:
    """The messages as a DBC."""
    nodes = sorted({message.sender for message in messages})
    lines = [f'VERSION "{version}"', "", "NS_ :", "", "BS_:", "", "BU_: " + " ".join(nodes), ""]
    for message in messages:
        lines.append(f"BO_ {message.identifier} {message.name}: {message.length} {message.sender}")
        for field in message.fields:
            low, high = (field.factor * raw + field.offset for raw in field.raw_range)
            order, sign = 0 if field.motorola else 1, "-" if field.signed else "+"
            lines.append(
                f" SG_ {field.name} : {field.start}|{field.length}@{order}{sign}"
                f' ({field.factor:.10g},{field.offset:.10g}) [{low:.10g}|{high:.10g}] "{field.unit}" Vector__XXX'
            )
        lines.append("")
    for message in messages:
        for field in message.fields:
            if field.comment:
                lines.append(f'CM_ SG_ {message.identifier} {field.name} "{field.comment}";')
    lines += ['BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;', 'BA_DEF_DEF_ "GenMsgCycleTime" 0;']
    lines += [f'BA_ "GenMsgCycleTime" BO_ {m.identifier} {round(1000 / m.rate)};' for m in messages]
    return "\n".join(lines) + "\n"
