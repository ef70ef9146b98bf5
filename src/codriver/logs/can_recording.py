"""A recording made of CAN frames: a database gives the frames their signals, which are decoded when asked for.

A message may reach a trace more than once: on several buses through a gateway, or, in J1939, from several source
addresses. Its signals are then taken from the stream with the most frames, and a fault says which; mixing them would
make two quantities one. Where the trace's clock starts anew, all messages keep the same stretch (`codriver.logs.clock`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from codriver.errors import LogError
from codriver.logs.can_bits import take
from codriver.logs.can_streams import Stream, find_streams, list_streams, name_identifier
from codriver.logs.clock import breaks, shared_run
from codriver.logs.dbc import Database, MessageLayout, decode, load_database
from codriver.logs.frames import Frames
from codriver.logs.recording import RawSignal, Recording, SourceChannel


class CanRecording(Recording):
    """CAN frames with the database that describes them; channels are called "Message.Signal".

    Time is that of the frames: seconds from the start of the measurement for BLF, ASC and TRC, and as written in
    candump logs, whose stamps are seconds since 1970.

    Args:
        path: where the frames come from.
        format: what it is, for people ("BLF, CAN trace").
        frames: all data frames of the trace.
        dbc: the database; None where the caller gave none.
        bus: the channel to keep; None keeps all.
        faults: what the reader of the trace found; kept and added to.

    Raises:
        LogError: there are no frames (on this bus), no database is given or it cannot be parsed, or it describes none
            of the identifiers in the trace.
    """

    def __init__(
        self, path: str, format: str, frames: Frames, dbc: Path | None, bus: int | None, faults: list[str]
    ) -> None:
        self.path, self.format, self.frames, self.faults = path, format, frames, faults
        streams = _on_bus(path, find_streams(frames), bus)
        streams = _one_run(frames, streams, self.faults)
        if dbc is None:
            raise LogError(
                f"{path} is a raw CAN trace of {sum(map(len, streams))} frames with {len(streams)} identifiers: "
                f"{list_streams(streams)}",
                "a CAN database that says what the frames mean",
                "give the DBC file of the vehicle with --dbc",
            )
        database = load_database(dbc)
        self.faults.extend(database.faults)
        self._streams = streams
        self._messages = database.messages
        self._found = _find_messages(database, streams)
        if not self._found:
            expected = [name_identifier(m.identifier, m.extended) for m in database.messages.values()]
            raise LogError(
                f"{path} holds none of the messages of {dbc}; its {len(streams)} identifiers are "
                f"{list_streams(streams)}",
                f"one of the {len(expected)} identifiers of the database: {', '.join(expected[:8])}"
                + (", ..." if len(expected) > 8 else ""),
                "give the DBC file that belongs to this bus of this vehicle",
            )

    def channels(self) -> Mapping[str, SourceChannel]:
        """All signals of the messages in the trace, as "Message.Signal"."""
        return {
            f"{name}.{signal.name}": SourceChannel(f"{name}.{signal.name}", signal.unit, signal.comment)
            for name in self._found
            for signal in self._messages[name].signals.values()
        }

    def load(self, names: Iterable[str]) -> dict[str, RawSignal]:
        """The samples of the signals named, decoding their messages only."""
        asked: dict[str, list[str]] = {}
        for name in names:
            message, _, signal = name.partition(".")
            if message in self._messages and signal in self._messages[message].signals:
                asked.setdefault(message, []).append(signal)
        self._tell_absent(asked)
        loaded: dict[str, RawSignal] = {}
        for message, signals in asked.items():
            if message in self._found:
                loaded.update(self._load_message(self._messages[message], signals))
        return loaded

    def _load_message(self, message: MessageLayout, signals: list[str]) -> dict[str, RawSignal]:
        """The samples of some signals of one message."""
        stream = self._choose(message)
        rows = stream.rows
        time, payload, length = self.frames.time[rows], take(self.frames.data, rows), self.frames.length[rows]
        loaded, short = {}, 0
        for name in dict.fromkeys(signals):
            signal = message.signals[name]
            carried, values = decode(payload, length, signal)
            short = max(short, int((length < signal.needs).sum()))
            stamps = time if carried is None else time[carried]
            loaded[f"{message.name}.{name}"] = RawSignal(stamps, values, signal.unit)
        if short:
            self._tell(f"{message.name}: {short} of {len(stream)} frames are too short for its signals; left out")
        return loaded

    def _choose(self, message: MessageLayout) -> Stream:
        """The stream a message is taken from: the one with the most frames long enough for something in it."""
        candidates = self._found[message.name]
        if len(candidates) == 1:
            return candidates[0]
        needs = min((signal.needs for signal in message.signals.values()), default=0)
        best = max(candidates, key=lambda stream: int((self.frames.length[stream.rows] >= needs).sum()))
        if any(stream.bus != best.bus for stream in candidates):
            buses = ", ".join(f"{bus}" for bus in sorted({stream.bus for stream in candidates}))
            self._tell(
                f"{message.name} is on the buses {buses}; that on bus {best.bus} is taken (--bus chooses another)"
            )
        same = [stream for stream in candidates if stream.bus == best.bus]
        if len(same) > 1:
            sources = ", ".join(f"{source}" for source in sorted(stream.identifier & 0xFF for stream in same))
            taken = best.identifier & 0xFF
            self._tell(f"{message.name} comes from the source addresses {sources}; that from {taken} is taken")
        return best

    def _tell_absent(self, asked: Mapping[str, list[str]]) -> None:
        """A fault where most of the messages asked for are not in the trace: a sign of a wrong database or bus."""
        absent = [name for name in asked if name not in self._found]
        if len(absent) > len(asked) / 2:
            known = {id(stream) for streams in self._found.values() for stream in streams}
            unknown = len(self._streams) - len(known)
            self._tell(
                f"{len(absent)} of the {len(asked)} messages asked for are not in the trace ({', '.join(absent[:4])}), "
                f"and {unknown} of its {len(self._streams)} identifiers are not in the database; is it this bus's?"
            )

    def _tell(self, fault: str) -> None:
        """Add a fault once, however often signals are loaded."""
        if fault not in self.faults:
            self.faults.append(fault)


def _on_bus(path: str, streams: list[Stream], bus: int | None) -> list[Stream]:
    """The streams of one bus, or all of them."""
    if not streams:
        raise LogError(f"{path} holds no CAN data frames", "a trace of a running bus", "check the recording")
    if bus is None:
        return streams
    kept = [stream for stream in streams if stream.bus == bus]
    if not kept:
        counts: dict[int, int] = {}
        for stream in streams:
            counts[stream.bus] = counts.get(stream.bus, 0) + len(stream)
        raise LogError(
            f"{path} has no frames on bus {bus}",
            "one of its buses: " + ", ".join(f"{number} ({count} frames)" for number, count in sorted(counts.items())),
            "give one of them with --bus, or none to take all",
        )
    return kept


def _one_run(frames: Frames, streams: list[Stream], faults: list[str]) -> list[Stream]:
    """The streams without the frames before or after a new start of their clock; what is left out is told."""
    if not breaks(frames.time).size:
        return streams
    kept = np.ones(len(frames), bool)
    for group in _clocks(frames, streams):
        rows = _rows(group)
        kept[rows], notes = shared_run(frames.time[rows], (np.searchsorted(rows, stream.rows) for stream in group))
        faults.extend(f"the trace{_on(group, streams)}: {note}" for note in notes)
    left = [Stream(s.bus, s.identifier, s.extended, s.rows[kept[s.rows]]) for s in streams]
    return [stream for stream in left if len(stream)]


def _clocks(frames: Frames, streams: list[Stream]) -> list[list[Stream]]:
    """The streams by clock: the buses of a trace share one, unless their frames in turn make it jump."""
    buses = [[stream for stream in streams if stream.bus == bus] for bus in sorted({stream.bus for stream in streams})]
    alone = max(breaks(frames.time[_rows(group)]).size for group in buses)
    return [streams] if breaks(frames.time[_rows(streams)]).size <= alone else buses


def _rows(streams: list[Stream]) -> npt.NDArray[np.int64]:
    """The places in the trace of the frames of some streams, ascending."""
    return np.sort(np.concatenate([stream.rows for stream in streams]))


def _on(group: list[Stream], streams: list[Stream]) -> str:
    """The bus of a group, for messages; nothing where it is all there is."""
    return f" on bus {group[0].bus}" if len(group) < len(streams) else ""


def _find_messages(database: Database, streams: list[Stream]) -> dict[str, list[Stream]]:
    """The streams that carry each message of a database; messages that none carries are left out."""
    found: dict[str, list[Stream]] = {}
    for message in database.messages.values():
        carrying = [stream for stream in streams if message.matches(stream.identifier, stream.extended)]
        # In J1939, a stream whose source address too is the database's is meant before all others.
        exact = [stream for stream in carrying if stream.identifier == message.identifier]
        if carrying:
            found[message.name] = exact or carrying
    return found
