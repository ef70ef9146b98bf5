"""From CAN frames to a live session: python-can gives frames, cantools decodes them, a names file names the signals.

with can.Bus(interface="socketcan", channel="can0") as bus:
    for tick in listen(bus, Live(program), BusDecoder("car.dbc", "names.toml")):
        print(tick.time, tick.values["intentional_jerk"])
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from codriver.errors import LogError, NamesError
from codriver.live.session import Live, Tick
from codriver.logs.names_file import Entry, NamesFile, load_names
from codriver.signals.sampler import TOLERANCE


class BusDecoder:
    """Turns frames into standard signals, by the same names file and conversions as a recorded log.

    Args:
        dbc: CAN database.
        names: names file, or loaded already; channels are "Message.Signal".

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
        absent = sorted({s for e in mapping.entries.values() for s in e.source if s not in units})
        if absent:
            raise NamesError(
                f"{mapping.where or 'the names file'} maps {', '.join(absent[:4])}, which {dbc} does not have",
                "channels of the database, as 'Message.Signal'",
                "correct the names file; `codriver info LOG --dbc DBC` lists the channels of a log",
            )
        self._latest: dict[str, float] = {}
        self._messages = {m.frame_id: m for m in database.messages}
        # By message: the entries whose first source it carries (their clock), with gain and shift of each source.
        self._entries: dict[str, list[tuple[Entry, list[tuple[float, float]]]]] = {}
        for entry in mapping.entries.values():
            conversions = [entry.conversion(units[source]) for source in entry.source]
            self._entries.setdefault(entry.source[0].split(".")[0], []).append((entry, conversions))
        self._wanted = {s for e in mapping.entries.values() for s in e.source}

    def decode(self, identifier: int, data: bytes) -> list[tuple[str, float]]:
        """Standard names and SI values that a frame brings; nothing for frames that are not mapped or too short."""
        message = self._messages.get(identifier)
        if message is None:
            return []
        try:
            numbers = message.decode(data, decode_choices=False, allow_truncated=True)
        except Exception:
            return []  # a frame that does not fit its database is lost, not the session
        for signal, number in numbers.items():
            if f"{message.name}.{signal}" in self._wanted:
                self._latest[f"{message.name}.{signal}"] = float(number)
        found = []
        for entry, conversions in self._entries.get(message.name, []):
            if entry.source[0].split(".", 1)[1] in numbers and all(s in self._latest for s in entry.source):
                parts = [g * self._latest[s] + b for s, (g, b) in zip(entry.source, conversions, strict=True)]
                found.append((entry.name, sum(parts) / len(parts)))
        return found


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
        # A value belongs to a tick up to TOLERANCE before its stamp, so later ticks wait for it and its equals.
        yield from live.advance(frame.timestamp - TOLERANCE - 1e-9)
        for name, value in decoder.decode(frame.arbitration_id, bytes(frame.data)):
            live.push(name, frame.timestamp, value)
