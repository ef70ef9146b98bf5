"""CAN databases, and the decoding of whole columns of frames by them.

cantools reads the database; the decoding is ours, a column of frames at a time. A multiplexed signal has a sample in
those frames only whose multiplexer, as a raw number, selects it; so has one behind several multiplexers. A value that
the database gives a text ("choice") stays a number, and values that stand for "not available" are not guessed: they
come out scaled like any other. Container messages (AUTOSAR PDUs) are out of scope and left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from codriver.errors import LogError
from codriver.logs.can_bits import Layout, Payload, extract, take
from codriver.signals.signal import Array

if TYPE_CHECKING:
    import cantools.database.can as cantools_can

# The message by which Vector's tools keep signals that belong to no message.
_NO_MESSAGE = "VECTOR__INDEPENDENT_SIG_MSG"


@dataclass(frozen=True)
class SignalLayout:
    """One signal of a message: physical value = raw * scale + offset.

    Attributes:
        name: as the database calls it.
        raw: where its raw number lies.
        scale, offset: to its unit.
        unit: as the database spells it; "" where it gives none.
        comment: what the database says of it.
        selectors: the multiplexers it lies behind, each with the raw values that select it; all must hold.
        needs: bytes a frame must have, those of the multiplexers included.
    """

    name: str
    raw: Layout
    scale: float = 1.0
    offset: float = 0.0
    unit: str = ""
    comment: str = ""
    selectors: tuple[tuple[Layout, tuple[int, ...]], ...] = ()

    @property
    def needs(self) -> int:
        """Bytes that a frame must have."""
        return max(self.raw.needs, *(layout.needs for layout, _ in self.selectors), 0)


@dataclass(frozen=True)
class MessageLayout:
    """One message of a database.

    Attributes:
        name: as the database calls it.
        identifier: 11 or 29 bits.
        extended: True for a 29-bit identifier.
        j1939: True where only the parameter group of the identifier counts, not its priority and source address.
        signals: by name.
    """

    name: str
    identifier: int
    extended: bool
    j1939: bool = False
    signals: Mapping[str, SignalLayout] = field(default_factory=dict)

    def matches(self, identifier: int, extended: bool) -> bool:
        """Whether frames of this identifier carry the message."""
        if extended != self.extended:
            return False
        if self.j1939:
            return parameter_group(identifier) == parameter_group(self.identifier)
        return identifier == self.identifier


@dataclass(frozen=True)
class Database:
    """A CAN database: its messages by name, and what was wrong with the file and could be got round."""

    path: str
    messages: Mapping[str, MessageLayout]
    faults: tuple[str, ...] = ()


def parameter_group(identifier: int) -> int:
    """The J1939 parameter group number of a 29-bit identifier: without priority, source and destination address."""
    group = (identifier >> 8) & 0x3FFFF
    # PDU format below 240: the low byte is the destination address, no part of the group.
    return group & 0x3FF00 if (group >> 8) & 0xFF < 240 else group


def decode(
    payload: Payload, length: npt.NDArray[np.uint8], signal: SignalLayout
) -> tuple[npt.NDArray[np.bool_] | None, Array]:
    """One signal from a column of payloads of its message.

    Args:
        payload: shape (n, w), w >= 8, rows contiguous.
        length: bytes of each payload, shape (n,).
        signal: what to decode.

    Returns:
        carried: shape (n,), True in the frames that carry the signal, or None where all do;
        values: physical values, shape (number that carry it,).
    """
    carried: npt.NDArray[np.bool_] | None = None
    if signal.needs > payload.shape[1]:
        return np.zeros(payload.shape[0], bool), np.zeros(0)
    enough = length >= signal.needs
    if not enough.all():
        carried = enough
    for layout, chosen in signal.selectors:
        # Multiplexers have few bits, so float64 holds their raw values exactly.
        selected = np.isin(extract(payload, layout), np.array(chosen, float))
        carried = selected if carried is None else carried & selected
    if carried is not None and carried.all():
        carried = None
    values = extract(payload if carried is None else take(payload, carried), signal.raw)
    if signal.scale != 1.0:
        values *= signal.scale
    if signal.offset != 0.0:
        values += signal.offset
    return carried, values


def load_database(path: Path) -> Database:
    """Read a CAN database: DBC, or another format that cantools tells by its suffix (.kcd, .sym, .arxml).

    A database that a strict reading refuses (overlapping signals, signals beyond the end of their message) is read
    leniently, and a fault says so.

    Raises:
        LogError: it cannot be read or parsed.
    """
    faults: list[str] = []
    try:
        source = _parse(path, strict=True)
    except OSError as error:
        raise LogError(
            f"cannot read the CAN database {path}: {error.strerror}", "a DBC file", "check the path given with --dbc"
        ) from None
    except Exception as strict_error:  # cantools raises errors of many classes, those of its parsers included
        try:
            source = _parse(path, strict=False)
        except Exception as error:
            raise LogError(
                f"{path} cannot be parsed as a CAN database: {_first_line(error)}",
                "a DBC file",
                "give the database of this vehicle with --dbc; mend the place named if it is damaged",
            ) from None
        faults.append(f"{path.name} is not quite right and was read leniently: {_first_line(strict_error)}")
    messages: dict[str, MessageLayout] = {}
    for message in getattr(source, "messages", ()):
        if not message.is_container and message.name != _NO_MESSAGE:
            messages.setdefault(message.name, _message(message))
    if not messages:
        raise LogError(
            f"{path} describes no CAN message",
            "a DBC file with messages",
            "give the database of this vehicle with --dbc",
        )
    return Database(str(path), messages, tuple(faults))


def _parse(path: Path, *, strict: bool) -> Any:
    """cantools' database of a file."""
    # Inside, since cantools wakes python-can and whatever that finds installed: more than a second.
    import cantools.database

    if path.suffix.lower() != ".dbc":
        return cantools.database.load_file(path, strict=strict)
    content = path.read_bytes()
    # DBC files name no encoding. Text that is UTF-8 throughout is UTF-8; Vector's tools write cp1252.
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    return cantools.database.load_string(text, database_format="dbc", strict=strict)


def _first_line(error: Exception) -> str:
    """The first line of an error's text, or its class where it has none."""
    return next(iter(str(error).splitlines()), "") or type(error).__name__


def _message(message: cantools_can.Message) -> MessageLayout:
    """Our layout of one of cantools' messages."""
    by_name = {signal.name: signal for signal in message.signals}
    signals = {}
    for signal in message.signals:
        if not 0 < signal.length <= 64:  # text and other matter that is no number
            continue
        signals[signal.name] = SignalLayout(
            signal.name,
            _layout(signal),
            float(signal.conversion.scale),
            float(signal.conversion.offset),
            signal.unit or "",
            signal.comment or "",
            _selectors(signal, by_name),
        )
    return MessageLayout(
        message.name, message.frame_id, message.is_extended_frame, message.protocol == "j1939", signals
    )


def _layout(signal: cantools_can.Signal) -> Layout:
    """Where the raw number of one of cantools' signals lies."""
    kind = "f" if signal.conversion.is_float else "i" if signal.is_signed else "u"
    return Layout(signal.start, signal.length, signal.byte_order == "little_endian", kind)


def _selectors(
    signal: cantools_can.Signal, by_name: Mapping[str, cantools_can.Signal]
) -> tuple[tuple[Layout, tuple[int, ...]], ...]:
    """The multiplexers a signal lies behind, from the nearest to the outermost."""
    found: list[tuple[Layout, tuple[int, ...]]] = []
    while signal.multiplexer_signal is not None and len(found) < len(by_name):
        parent = by_name[signal.multiplexer_signal]
        found.append((_layout(parent), tuple(signal.multiplexer_ids or ())))
        signal = parent
    return tuple(found)
