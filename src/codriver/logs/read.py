"""From a recording to a Log: channels by standard name, in SI units, on clocks that run forward."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from codriver.errors import LogError, NamesError, UnitError
from codriver.logs.clock import mend_clock
from codriver.logs.mean import mean_of
from codriver.logs.mend import compare_clocks, drop_codes, find_faults, named
from codriver.logs.names_file import Entry, NamesFile, load_names
from codriver.logs.namesakes import own_name, tell_namesakes
from codriver.logs.recording import RawSignal, Recording
from codriver.logs.registry import ReadOptions, find_reader
from codriver.names import VOCABULARY, nearest
from codriver.signals import Log, Signal
from codriver.signals.signal import Array


def open_recording(
    path: str | Path, *, dbc: str | Path | None = None, bus: int | None = None, rate: float | None = None
) -> Recording:
    """Open a recording without loading its samples.

    Args:
        path: a file or a folder of a known layout.
        dbc: CAN database, for raw CAN traces.
        bus: CAN channel to keep; None keeps all.
        rate: rows a second of a table without a time column.

    Raises:
        LogError: it does not exist, or cannot be read.
        FormatError: no reader knows it, or it is not what its name promises.
    """
    path = Path(path)
    return find_reader(path).function(path, ReadOptions(Path(dbc) if dbc is not None else None, bus, rate))


def read(
    path: str | Path,
    *,
    dbc: str | Path | None = None,
    names: str | Path | NamesFile | None = None,
    bus: int | None = None,
) -> Log:
    """Read a recording as a Log of standard signals in SI units.

    Without a names file, the mapping of a known layout is used; for others, channels whose own name is a standard name.
    What is wrong with the recording and can be got round (time running backwards, duplicate stamps, NaN, a stuck signal)
    is told in `Log.faults`.

    Args:
        path: a file or a folder of a known layout.
        dbc: CAN database, for raw CAN traces.
        names: names file (a path, or loaded already).
        bus: CAN channel to keep; None keeps all.

    Raises:
        LogError: the recording cannot be read, or holds none of the signals.
        NamesError: the names file is wrong, or names channels that the recording lacks altogether.
        UnitError: a unit is unknown or of another kind.
    """
    mapping = load_names(names) if isinstance(names, (str, Path)) else names
    rate = mapping.rate if mapping is not None else None
    return read_recording(open_recording(path, dbc=dbc, bus=bus, rate=rate), mapping)


def read_recording(recording: Recording, names: str | Path | NamesFile | None = None) -> Log:
    """The Log of an opened recording; see `read`."""
    mapping = (
        names if isinstance(names, NamesFile) else load_names(names) if names is not None else recording.default_names
    )
    channels = recording.channels()
    own = mapping is None
    if mapping is None:
        mapping = own_names(recording)
    if not mapping.entries:
        listed = ", ".join(sorted(channels)[:12]) + (", ..." if len(channels) > 12 else "")
        raise LogError(
            f"{recording.path} ({recording.format}) has {len(channels)} channels, none with a standard name: {listed or '(none)'}",
            "channels named by the standard names, or a names file that maps them",
            "write a names file (docs/names.md shows how) and give it with --names",
        )
    faults: list[str] = []
    wanted = {channel for entry in mapping.entries.values() for channel in entry.channels}
    raw = recording.load(wanted)
    faults += tell_namesakes(recording, mapping, raw, own)
    signals = []
    for entry in mapping.entries.values():
        absent = [channel for channel in entry.channels if channel not in raw]
        if absent:
            near = nearest(absent[0], channels)
            faults.append(
                f"{entry.name}: the recording has no channel '{absent[0]}'"
                + (f"; did the names file mean {near}?" if near else "")
            )
        # The first of several sources gives the clock; a mean can do without the others.
        if entry.source[0] not in absent and entry.valid not in absent:
            there = {source: raw[source] for source in entry.source if source in raw}
            if names is not None:  # known layouts and columns with standard names may rely on SI units
                faults.extend(entry.doubts({source: part.unit for source, part in there.items()}))
            signals.append(_standard(entry, there, raw.get(entry.valid or ""), faults))
    faults.extend(f"{named(s.name, s.source)}: there is no sample of it; it is left out" for s in signals if not len(s))
    signals = [signal for signal in signals if len(signal)]
    if not signals:
        raise (LogError if names is None else NamesError)(
            f"{recording.path}: none of the {len(mapping.entries)} mapped signals has samples. " + " ".join(faults[:4]),
            "at least one channel that the recording holds",
            "`codriver info LOG` lists the channels; check the names file, the DBC and the bus",
        )
    signals, told = compare_clocks(signals)
    faults += told
    log = Log.of(signals, recording.path)
    all_faults = (*recording.faults, *faults, *log.implausible())
    return Log(log.signals, recording.path, all_faults, tuple(sorted(set(channels) - wanted)))


def own_names(recording: Recording) -> NamesFile:
    """The mapping of channels that bear standard names themselves: "time,longitudinal_speed,..." or "Message.gear"."""
    entries: dict[str, Entry] = {}
    for name in recording.channels():
        short = own_name(name)
        if short in VOCABULARY and short not in entries:
            entries[short] = Entry(short, (name,))
    return NamesFile(entries, "the channels' own names")


def _standard(entry: Entry, parts: Mapping[str, RawSignal], flag: RawSignal | None, faults: list[str]) -> Signal:
    """One standard signal from its raw parts, by their source, and the channel that says when they count."""
    target = VOCABULARY[entry.name].unit
    made = []
    for source, part in parts.items():
        time, values, notes = mend_clock(np.asarray(part.time, float), np.asarray(part.values, float))
        faults.extend(f"{named(entry.name, source)}: {note}" for note in notes)
        if flag is not None:
            counts = _up(flag, time)
            if not counts.all():
                left = (
                    f"{int((~counts).sum())} of {time.size} values left out, where {entry.valid} is 0 or not there yet"
                )
                faults.append(f"{named(entry.name, source)}: {left}")
                time, values = time[counts], values[counts]
        try:
            gain, shift = entry.conversion(part.unit)
        except UnitError as error:
            raise UnitError(f"{entry.name} ({source}): {error.found}", error.expected, error.do) from None
        values = values if (gain, shift) == (1.0, 0.0) else gain * values + shift
        made.append(Signal(entry.name, time, values, target, source))
    signal = made[0]
    if len(made) > 1:  # a code of one source would hide in the mean
        cleaned = [drop_codes(part) for part in made]
        faults.extend(sentence for _, told in cleaned for sentence in told)
        signal, silent = mean_of([part for part, _ in cleaned])
        faults.extend(silent)
    missing = find_faults(signal)  # before the codes below become NaN too, which would be told twice
    signal, codes = drop_codes(signal)
    faults.extend([*missing, *codes])
    return signal


def _up(flag: RawSignal, time: Array) -> npt.NDArray[np.bool_]:
    """Whether a flag's newest finite value at each time is not 0."""
    stamps, values, _ = mend_clock(np.asarray(flag.time, float), np.asarray(flag.values, float))
    finite = np.isfinite(values)
    stamps, up = stamps[finite], values[finite] != 0
    index = np.searchsorted(stamps, time, side="right") - 1
    return (index >= 0) & up[np.maximum(index, 0)] if stamps.size else np.zeros(time.size, bool)
