"""From CAN frames to a live session: python-can gives frames, cantools decodes them, a names file names the signals.

with can.Bus(interface="socketcan", channel="can0") as bus:
    for tick in listen(bus, Live(program), BusDecoder("car.dbc", "names.toml")):
        print(tick.time, tick.values["intentional_jerk"])
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any

from codriver.errors import LogError, NamesError
from codriver.live.session import Live, Tick
from codriver.logs.names_file import NamesFile, load_names
from codriver.names import VOCABULARY


@dataclass(frozen=True)
class _Part:
    """A signal of a message that feeds a standard signal, as source number `place`: standard = gain * value + shift.

    It counts while the channel `valid`, if any, is up.
    """

    name: str
    place: int
    signal: str
    gain: float
    shift: float
    valid: str | None


class BusDecoder:
    """Turns frames into standard signals, by the same names file and conversions as a recorded log.

    Args:
        dbc: CAN database.
        names: names file, or loaded already; channels are "Message.Signal".

    Attributes:
        faults: what is doubtful in the mapping, one sentence each.

    Raises:
        LogError: the database cannot be read.
        NamesError: the names file names a signal that the database lacks.
    """

    def __init__(self, dbc: str | Path, names: str | Path | NamesFile) -> None:
        import cantools.database

        mapping = names if isinstance(names, NamesFile) else load_names(names)
        try:
            database: Any = cantools.database.load_file(str(dbc))
        except (
            OSError,
            ValueError,
            cantools.database.Error,
            cantools.database.UnsupportedDatabaseFormatError,
        ) as error:
            raise LogError(
                f"cannot read {dbc}: {error}", "a CAN database (DBC)", "check the path and the file"
            ) from None
        units = {f"{m.name}.{s.name}": s.unit or "" for m in database.messages for s in m.signals}
        absent = sorted({s for e in mapping.entries.values() for s in e.channels if s not in units})
        if absent:
            raise NamesError(
                f"{mapping.where or 'the names file'} maps {', '.join(absent[:4])}, which {dbc} does not have",
                "channels of the database, as 'Message.Signal'",
                "correct the names file; `codriver info LOG --dbc DBC` lists the channels of a log",
            )
        self.faults = [
            fault
            for e in mapping.entries.values()
            for fault in e.doubts({source: units[source] for source in e.source})
        ]
        self._messages = {m.frame_id: m for m in database.messages}
        # By message: what its signals feed.
        self._parts: dict[str, list[_Part]] = {}
        for entry in mapping.entries.values():
            for place, source in enumerate(entry.source):
                message, signal = source.split(".", 1)
                part = _Part(entry.name, place, signal, *entry.conversion(units[source]), entry.valid)
                self._parts.setdefault(message, []).append(part)
        # Whether each channel that says when others count is up; by message, those it carries.
        self._up = {e.valid: False for e in mapping.entries.values() if e.valid is not None}
        self._flags: dict[str, list[str]] = {}
        for channel in self._up:
            self._flags.setdefault(channel.split(".", 1)[0], []).append(channel)
        # Newest stamp and SI value of each source, by standard name; those of a source not met yet are too old for ever.
        self._latest = {e.name: [(-inf, nan)] * len(e.source) for e in mapping.entries.values()}

    def decode(self, identifier: int, data: bytes, time: float) -> list[tuple[str, float]]:
        """Standard names and SI values that a frame brings; nothing for frames that are not mapped or too short.

        Values outside what the quantity can show are left out, as codes for "not valid". A recorded log is judged as a
        whole instead, and keeps such values where they are many or of many kinds (`codriver.logs.mend.drop_codes`). Of
        several sources the mean is taken as in a recorded log, see `codriver.logs.mean`.

        Args:
            identifier, data: of the frame.
            time: its stamp, s, not decreasing.
        """
        message = self._messages.get(identifier)
        if message is None:
            return []
        try:
            numbers = message.decode(data, decode_choices=False, allow_truncated=True)
        except Exception:
            return []  # a frame that does not fit its database is lost, not the session
        for channel in self._flags.get(message.name, []):
            flag = float(numbers.get(channel.split(".", 1)[1], nan))
            if isfinite(flag):
                self._up[channel] = flag != 0
        brought = []
        for part in self._parts.get(message.name, []):
            value = part.gain * float(numbers.get(part.signal, nan)) + part.shift
            if part.valid is not None and not self._up[part.valid]:
                continue
            quantity = VOCABULARY[part.name]
            if isfinite(value) and quantity.low <= value <= quantity.high:
                self._latest[part.name][part.place] = (time, value)
                if part.place == 0:  # the first source is the clock
                    brought.append(part.name)
        return [(name, self._mean(name, time)) for name in brought]

    def _mean(self, name: str, time: float) -> float:
        """The mean of the newest values of a signal's sources, without those older than its hold time."""
        hold = VOCABULARY[name].hold
        alive = [value for stamp, value in self._latest[name] if stamp > -inf and time - stamp <= hold]
        return sum(alive) / len(alive)


def listen(frames: Iterable[Any], live: Live, decoder: BusDecoder) -> Iterator[Tick]:
    """Run a session on python-can messages: a `can.Bus`, or any iterable of `can.Message`.

    A tick is stepped when a frame with a later stamp arrives, so that no value comes too late for its tick.

    Args:
        frames: messages with timestamp, s, not decreasing.
        live: the session.
        decoder: what the frames mean.
    """
    for frame in frames:
        if frame.is_error_frame or frame.is_remote_frame:
            continue
        yield from live.advance_before(frame.timestamp)
        for name, value in decoder.decode(frame.arbitration_id, bytes(frame.data), frame.timestamp):
            live.push(name, frame.timestamp, value)
