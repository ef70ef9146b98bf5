"""codriver info: what a log holds, and what it can feed."""

from __future__ import annotations

import json as json_module
from typing import Any

import typer

from codriver.cli.options import Bus, Dbc, Json, LogPath, Names, VehicleName


def info(
    log: LogPath, dbc: Dbc = None, names: Names = None, vehicle: VehicleName = None, bus: Bus = None, json: Json = False
) -> None:
    """Say what a log holds, which estimators it can feed, what is missing, and which is the best available."""
    from codriver.cli.options import check_inputs
    from codriver.logs import open_recording
    from codriver.logs.names_file import load_names
    from codriver.logs.propose import propose_names
    from codriver.logs.read import own_names, read_recording
    from codriver.observers.feed import best, feeds, least_demanding
    from codriver.observers.gears import unknown_gears
    from codriver.observers.registry import families
    from codriver.signals import Log
    from codriver.vehicles import load_vehicle

    check_inputs(log, dbc, names)
    car = load_vehicle(vehicle) if vehicle is not None else None
    mapping = load_names(names) if names is not None else None
    recording = open_recording(log, dbc=dbc, bus=bus, rate=mapping.rate if mapping is not None else None)
    channels = recording.channels()
    begins = None
    if mapping is None and recording.default_names is None and not own_names(recording).entries:
        signals = Log({}, str(log), tuple(recording.faults), tuple(sorted(channels)))  # nothing is mapped yet
        begins = propose_names(recording)
    else:
        signals = read_recording(recording, mapping)
    # Without a vehicle, say what the log alone allows: parameters are told apart from signals.
    found = feeds(signals, car)
    by_family = {family: [f for f in found if f.family == family] for family in families()}
    choice, with_vehicle = {}, {}
    for family, members in by_family.items():
        fed = [f for f in members if not f.missing]
        choice[family] = best(signals, car, family=family).estimator if any(f.possible for f in members) else None
        with_vehicle[family] = fed[0].estimator if fed else None
    summary: dict[str, Any] = {
        "log": str(log),
        "format": recording.format,
        "from_s": signals.start,
        "to_s": signals.stop,
        "signals": [signal.to_dict() for signal in signals.values()],
        "channels": [{"name": c.name, "unit": c.unit} for c in channels.values()],
        "unmapped": list(signals.unmapped),
        "names_file_begins": begins,
        "faults": list(signals.faults),
        "findings": [{"severity": f.severity, "text": f.text} for f in unknown_gears(signals, car)] if car else [],
        "estimators": [
            {
                "name": f.estimator,
                "signals_there": not f.missing,
                "missing_signals": list(f.missing),
                "missing_parameters": list(f.lacking),
                "possible": f.possible,
                "meaning": f.meaning,
                "family": f.family,
            }
            for f in found
        ],
        "best": choice,
        "best_with_a_vehicle": with_vehicle,
        "least_demanding": {family: least_demanding(family) for family in by_family},
        "vehicle": car.name if car is not None else None,
    }
    if json:
        typer.echo(json_module.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        _show(summary)


def _show(summary: dict[str, Any]) -> None:
    """The summary as tables."""
    from rich.markup import escape
    from rich.table import Table

    from codriver.cli.terminal import console, say_findings

    out = console()
    span = ""
    if summary["signals"]:
        start, stop = summary["from_s"], summary["to_s"]
        span = f", {stop - start:.1f} s ({start:.2f} to {stop:.2f} s)"
    out.print(f"[bold]{escape(summary['log'])}[/]: {escape(summary['format'])}{span}\n")
    if summary["signals"]:
        table = Table(box=None, pad_edge=False)
        for column in ("signal", "unit", "samples", "rate Hz", "minimum", "maximum", "missing", "source"):
            left = column in ("signal", "unit", "source")
            # On a narrow terminal the source folds; numbers are never cut.
            table.add_column(
                column,
                justify="left" if left else "right",
                no_wrap=column != "source",
                overflow="fold",
                min_width=len(column),
            )
        for s in summary["signals"]:
            numbers = [f"{s[key]:.4g}" if s[key] is not None else "-" for key in ("rate_hz", "minimum", "maximum")]
            table.add_row(s["name"], s["unit"], str(s["samples"]), *numbers, str(s["missing"]), escape(s["source"]))
        out.print(table)
    else:
        out.print("no channel has a standard name: say in a names file which is which, and give it with --names")
        out.print("it begins like this (docs/names.md has the standard names):\n")
        out.print(
            "".join(f"  {line}\n" for line in summary["names_file_begins"].splitlines()), markup=False, soft_wrap=True
        )
    if summary["unmapped"]:
        # Whoever has still to write a names file wants the whole list.
        most = 24 if summary["signals"] else 300
        more = ", ... (--json lists all)" if len(summary["unmapped"]) > most else ""
        out.print(f"\nnot mapped ({len(summary['unmapped'])}): {escape(', '.join(summary['unmapped'][:most]))}{more}")
    for fault in summary["faults"]:
        out.print(f"[yellow]warn[/] {escape(fault)}")
    if summary["findings"]:
        out.print(f"\n[bold]vehicle {escape(summary['vehicle'])}[/]")
        say_findings(out, summary["findings"])
    out.print("\n[bold]estimators[/]")
    families = dict.fromkeys(e["family"] for e in summary["estimators"])
    for family in families:
        _show_family(family, [e for e in summary["estimators"] if e["family"] == family], summary)
    _show_best(summary)


def _show_family(family: str, members: list[dict[str, Any]], summary: dict[str, Any]) -> None:
    """The estimators of a family, a line each; one line for all where the log has the signals of none, and of another's."""
    from codriver.cli.terminal import console, some

    out = console()
    # Where nothing is mapped yet, the first family is told in full.
    others = any(e["signals_there"] for e in summary["estimators"]) or family != summary["estimators"][0]["family"]
    if others and not any(e["signals_there"] for e in members):
        least = next(e for e in members if e["name"] == summary["least_demanding"][family])
        out.print(
            f"  [red]no[/]   {family}: {len(members)} estimators; {least['name']}, which needs the least, lacks signals: "
            + ", ".join(least["missing_signals"])
        )
        return
    for e in members:
        if e["possible"]:
            out.print(f"  [green]yes[/]  {e['name']:<21} {e['meaning']}")
            continue
        lacks = [f"signals: {', '.join(e['missing_signals'])}"] if e["missing_signals"] else []
        if e["missing_parameters"]:
            given = summary["vehicle"] is not None
            lacks.append(f"vehicle parameters: {some(e['missing_parameters'])}" if given else "a vehicle (--vehicle)")
        mark = "[yellow]part[/]" if e["signals_there"] else "[red]no[/]  "
        out.print(f"  {mark} {e['name']:<21} lacks {'; '.join(lacks)}")


def _show_best(summary: dict[str, Any]) -> None:
    """The best estimator of each family that the log can feed; if there is none at all, what the least demanding lacks."""
    from codriver.cli.terminal import console

    out = console()
    told = False
    for family, choice in summary["best"].items():
        with_vehicle = summary["best_with_a_vehicle"][family]
        if choice is None and with_vehicle is None:
            continue
        file = "another kind of vehicle" if summary["vehicle"] is not None else "a vehicle file"
        more = f"with {file}, {with_vehicle}" if with_vehicle != choice else ""
        text = "; ".join(part for part in (f"[bold]{choice}[/]" if choice else "", more) if part)
        out.print(("" if told else "\n") + f"best available for {family}: {text}")
        told = True
    if told:
        return
    # The first family is what a log is mostly wanted for.
    least = next(iter(summary["least_demanding"].values()))
    entry = next(e for e in summary["estimators"] if e["name"] == least)
    out.print(
        f"\nno estimator can be fed: {least}, which needs the least, lacks " + " and ".join(entry["missing_signals"])
    )
