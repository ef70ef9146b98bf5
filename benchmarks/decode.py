"""How fast CAN traces become signals: `python benchmarks/decode.py [frames]`.

Ours against cantools (decoding) and python-can (reading traces), on one core, best of three. cantools goes frame by
frame at a steady pace, so it is measured on a part of the frames and scaled; the notes say how large the part was.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
import tracemalloc
from pathlib import Path

import can
import cantools.database
import numpy as np

from codriver.logs.blf import parse_blf
from codriver.logs.can_recording import CanRecording
from codriver.logs.candump import parse_candump
from codriver.logs.frames import Frames
from codriver.logs.text_traces import parse_asc, parse_trc

MESSAGES = 20
# Four signals a message, as vehicles have them: both byte orders, signed and unsigned, 1 to 24 bits.
SIGNALS = """ SG_ Speed{k} : 0|16@1+ (0.01,0) [0|0] "km/h" X
 SG_ Torque{k} : 23|12@0- (0.5,-100) [0|0] "Nm" X
 SG_ Switch{k} : 35|1@1+ (1,0) [0|0] "" X
 SG_ Angle{k} : 47|24@0- (0.001,0) [0|0] "deg" X
"""


def database() -> str:
    """The text of a DBC file of `MESSAGES` messages."""
    messages = (f"BO_ {256 + k} M{k}: 8 X\n" + SIGNALS.format(k=k) for k in range(MESSAGES))
    return 'VERSION ""\nNS_ :\nBS_:\nBU_: X\n' + "\n".join(messages)


def trace(count: int) -> Frames:
    """Frames of all messages in random order, 5000 a second."""
    rng = np.random.default_rng(0)
    return Frames(
        np.arange(count) / 5000,
        np.ones(count, np.int16),
        rng.integers(256, 256 + MESSAGES, count).astype(np.uint32),
        np.zeros(count, bool),
        np.full(count, 8, np.uint8),
        rng.integers(0, 256, (count, 8), dtype=np.uint8),
    )


def best(work, times: int = 3) -> float:
    """The shortest time that the work takes, s."""
    took = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        took.append(time.perf_counter() - start)
    return min(took)


def row(what: str, ours: float, other: float, note: str) -> dict:
    """One line of the table."""
    return {"what": what, "ours_s": ours, "other_s": other, "ratio": other / ours, "note": note}


def decoding(count: int, part: int = 20_000) -> list[dict]:
    """Decoding by a DBC, all messages and two of them, against cantools."""
    frames = trace(count)
    oracle = cantools.database.load_string(database(), "dbc")
    pairs = [(int(i), d.tobytes()) for i, d in zip(frames.identifier[:part], frames.data[:part], strict=True)]
    theirs = best(lambda: [oracle.decode_message(i, d, decode_choices=False) for i, d in pairs]) * count / part
    some = best(lambda: [oracle.decode_message(i, d, decode_choices=False) for i, d in pairs if i in (256, 257)])
    theirs_some = some * count / part
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        dbc = Path(folder) / "a.dbc"
        dbc.write_text(database())

        def work(messages: int) -> None:
            recording = CanRecording("a", "a", frames, dbc, None, [])
            names = [name for name in recording.channels() if int(name.split(".")[0][1:]) < messages]
            recording.load(names)

        for messages, other in ((MESSAGES, theirs), (2, theirs_some)):
            ours = best(lambda messages=messages: work(messages))
            tracemalloc.start()
            work(messages)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            own = sum(getattr(frames, name).nbytes for name in frames.__dataclass_fields__)
            note = (
                f"{count / ours / 1e6:.1f} million frames/s, the DBC's parsing included; peak {peak / 1e6:.0f} MB "
                f"beside {own / 1e6:.0f} MB of frames; cantools measured on {part} frames"
            )
            rows.append(row(f"decode {messages} of {MESSAGES} messages, {count} frames", ours, other, note))
    return rows


FORMATS = (
    ("BLF", ".blf", can.BLFWriter, can.BLFReader, parse_blf),
    ("ASC", ".asc", can.ASCWriter, can.ASCReader, parse_asc),
    ("TRC", ".trc", can.TRCWriter, can.TRCReader, parse_trc),
    ("candump", ".log", can.CanutilsLogWriter, can.CanutilsLogReader, parse_candump),
)


def reading(count: int) -> list[dict]:
    """Reading each format, against python-can, which wrote the files."""
    rng = random.Random(0)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for title, suffix, writer, reader, parse in FORMATS:
            path = Path(folder) / f"a{suffix}"
            with writer(str(path)) as log:
                for k in range(count):
                    identifier = rng.randrange(256, 256 + MESSAGES)
                    log.on_message_received(
                        can.Message(1e9 + k / 5000, identifier, is_extended_id=False, data=rng.randbytes(8), channel=0)
                    )
            ours = best(lambda path=path, parse=parse: parse(path.read_bytes()))
            theirs = best(lambda path=path, reader=reader: sum(1 for _ in reader(str(path))), 1)
            note = f"{count / ours / 1e6:.2f} million frames/s, {path.stat().st_size / 1e6:.0f} MB"
            rows.append(row(f"read {title}, {count} frames", ours, theirs, note))
    return rows


def run(count: int = 5_000_000) -> list[dict]:
    """All rows; `count` frames are decoded, a fiftieth of them read from each format."""
    return decoding(count) + reading(max(count // 50, 1000))


def main() -> None:
    """Print the rows."""
    count = int(float(sys.argv[1])) if len(sys.argv) > 1 else 5_000_000
    print(f"{'what':45} {'ours, s':>8} {'other, s':>9} {'ratio':>7}  note")
    for r in run(count):
        print(f"{r['what']:45} {r['ours_s']:8.3f} {r['other_s']:9.2f} {r['ratio']:7.1f}  {r['note']}")


if __name__ == "__main__":
    main()
