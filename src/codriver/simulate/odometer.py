"""Wheel speed from teeth: how a brake unit makes a speed of the edges of a toothed ring.

A ring of N teeth on a wheel of rolling radius r passes its sensor every d = 2 pi r / N metres. At the end t_k of each
message period the unit takes the teeth n that passed since the last edge of the period before,

    v_k = n d / (e_last - e_first),

with e the edges' times, rounded down to the unit's timer. A period without an edge holds the speed, but no more than
d / (t_k - e_last): the wheel cannot have been quicker, or an edge would have come. After d / v_least without an edge
the wheel stands, v_k = 0; the first edge after that is only a beginning.

At constant speed the timer's rounding leaves an error of standard deviation v sqrt(f (1 - f)) delta / (e_last - e_first),
delta the timer's step and f the fraction of a step left over in n d / v; over speeds, sqrt(f (1 - f)) is 1 / sqrt(6) in
quadratic mean. The value is the speed of half-way between the two edges, so it is late by t_k - (e_first + e_last) / 2.
Teeth are not cut evenly: each stands off by its own share of d, the same at every turn.
"""

from __future__ import annotations

import numpy as np

from codriver.signals.signal import Array


def edge_times(time: Array, speed: Array, pitch: float, shares: Array, timer: float) -> Array:
    """When the teeth of a wheel pass the sensor, s, shape (edges,).

    Args:
        time: clock of the speed, s, shape (n,).
        speed: of the wheel, m/s, shape (n,); a wheel that rolls back shows no edges until it is where it was.
        pitch: d, m.
        shares: by how much of the pitch each tooth of one turn stands off, shape (N,).
        timer: step of the timer, s; 0 for a perfect one.
    """
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    way = np.maximum.accumulate(np.concatenate([[0.0], np.cumsum(steps)]))
    count = int(way[-1] / pitch + 0.5)
    places = (np.arange(1, count + 1) - 0.5) * pitch
    places += pitch * shares[np.arange(count) % shares.size]
    times = np.interp(places, way, time)
    return np.floor(times / timer) * timer if timer > 0.0 else times


def tooth_speed(edges: Array, times: Array, pitch: float, least: float) -> Array:
    """The speed the unit reports at the ends of its periods, m/s, shape (m,).

    Args:
        edges: from `edge_times`, s.
        times: ends of the periods, s, shape (m,), rising.
        pitch: d, m.
        least: v_least, m/s.
    """
    if edges.size == 0:
        return np.zeros(times.size)
    longest = pitch / least
    last = np.searchsorted(edges, times, side="right") - 1  # index of the newest edge, -1 before the first
    before = np.concatenate([[-1], last[:-1]])
    # The edge the counting starts from: the last of the period before, unless the wheel stood since.
    following = np.minimum(before + 1, edges.size - 1)
    stale = (before < 0) | (edges[following] - edges[np.maximum(before, 0)] > longest)
    first = np.where(stale, before + 1, before)
    teeth = np.where(last > before, last - first, 0)
    span = edges[np.maximum(last, 0)] - edges[np.clip(first, 0, edges.size - 1)]
    counted = (teeth > 0) & (span > 0.0)
    fresh = np.where(counted, teeth * pitch / np.where(counted, span, 1.0), 0.0)
    # Periods in which an edge came set the speed, be it to 0 for a first edge; the others hold it.
    news = np.maximum.accumulate(np.where(last > before, np.arange(times.size), 0))
    age = np.where(last >= 0, times - edges[np.maximum(last, 0)], np.inf)
    bound = np.where(age > 0.0, pitch / np.maximum(age, 1e-9), np.inf)
    held = np.where(last > before, fresh, np.minimum(fresh[news], bound))
    return np.where(age > longest, 0.0, held)
