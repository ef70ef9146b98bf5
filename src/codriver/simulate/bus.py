"""The CAN bus: when each message is sent, what it carries, which frames are lost; and trace files of it.

Message m goes out at  t_k = phase + k / rate + jitter,  jitter normal, with phase and jitter of its own; the sensors
were read a little earlier (`latency`). Frames are lost singly at random, and in holes: spans in which a
message is silent.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from codriver.logs.frames import Frames
from codriver.signals.signal import Array
from codriver.simulate.can_layout import Message, encode
from codriver.simulate.network import MESSAGES
from codriver.simulate.sensors import Instruments


@dataclass(frozen=True)
class Hole:
    """From `start` (s) on, for `length` seconds, no frame of `message` arrives."""

    message: str
    start: float
    length: float


@dataclass(frozen=True)
class BusParameters:
    """Attributes: jitter (standard deviation, s), latency from sensor to bus (s), share of frames lost, and holes."""

    jitter: float = 0.0003
    latency: float = 0.002
    loss: float = 0.005
    holes: tuple[Hole, ...] = ()


def drop_outs(
    stop: float,
    *,
    seed: int = 1,
    names: tuple[str, ...] = ("Wheels", "Dynamics", "EngineData", "PedalData", "Brakes", "Gearbox"),
    every: float = 120.0,
    shortest: float = 0.5,
    longest: float = 3.0,
) -> tuple[Hole, ...]:
    """Holes at random, by start: one in `every` seconds on average, whatever the driver does then.

    Args:
        stop: end of the drive, s.
        seed: of their places, lengths and messages.
        names: the messages that suffer, in turn.
        every: mean time between two holes, s.
        shortest, longest: bounds of their lengths, s.
    """
    random = np.random.default_rng([seed, 31])
    count = int(stop / every)
    starts = np.sort(random.uniform(0.0, max(stop - longest, 0.0), count))
    lengths = random.uniform(shortest, longest, count)
    return tuple(
        Hole(names[k % len(names)], float(start), float(length))
        for k, (start, length) in enumerate(zip(starts, lengths, strict=True))
    )


def transmit(
    instruments: Instruments,
    stop: float,
    bus: BusParameters,
    *,
    seed: int = 1,
    messages: tuple[Message, ...] = MESSAGES,
) -> Frames:
    """The frames of a drive, sorted by time.

    Args:
        instruments: the sensors.
        stop: end of the drive, s.
        bus: its imperfections.
        seed: of phases, jitter and losses.
        messages: what is sent.
    """
    random = np.random.default_rng([seed, 29])
    times, identifiers, lengths, payloads = [], [], [], []
    for message in messages:
        time, payload = _frames_of(message, instruments, stop, bus, random)
        times.append(time)
        identifiers.append(np.full(time.size, message.identifier, np.uint32))
        lengths.append(np.full(time.size, message.length, np.uint8))
        payloads.append(payload)
    time = np.concatenate(times)
    order = np.argsort(time, kind="stable")
    count = time.size
    return Frames(
        time[order],
        np.zeros(count, np.int16),
        np.concatenate(identifiers)[order],
        np.zeros(count, np.bool_),
        np.concatenate(lengths)[order],
        np.concatenate(payloads)[order],
    )


def _frames_of(
    message: Message, instruments: Instruments, stop: float, bus: BusParameters, random: np.random.Generator
) -> tuple[Array, Any]:
    """Times (n,) and payloads (n, 8) of one message."""
    phase = random.uniform(0, 1) / message.rate
    count = int((stop - phase) * message.rate)
    jitter = bus.jitter * np.clip(random.standard_normal(count), -3, 3)
    # Whole microseconds: the resolution of trace files.
    time = np.round(phase + np.arange(count) / message.rate + np.maximum(jitter, -phase), 6)
    read_at = np.maximum(time - bus.latency, 0.0)
    columns = {
        field.name: instruments.read(field.sensor, read_at) * field.to_unit
        if field.sensor
        else np.arange(count, dtype=float) % 16
        for field in message.fields
    }
    kept = random.random(count) >= bus.loss
    for hole in bus.holes:
        if hole.message == message.name:
            kept &= (time < hole.start) | (time >= hole.start + hole.length)
    payload = np.zeros((count, 8), np.uint8)
    payload[:, : message.length] = encode(message, columns)
    return time[kept], payload[kept]


def write_trace(path: str | Path, frames: Frames) -> Path:
    """Write frames as a CAN trace; the suffix (.blf, .asc, .log, .trc) decides the format. Returns the path."""
    import can

    path = Path(path)
    with can.Logger(str(path)) as logger:
        rows = zip(frames.time.tolist(), frames.bus.tolist(), frames.identifier.tolist(), frames.extended.tolist(),
                   frames.length.tolist(), frames.data, strict=True)  # fmt: skip
        for time, channel, identifier, extended, length, data in rows:
            logger(
                can.Message(
                    timestamp=time,
                    arbitration_id=identifier,
                    is_extended_id=extended,
                    dlc=length,
                    data=data[:length].tobytes(),
                    channel=channel,
                )
            )
    return path
