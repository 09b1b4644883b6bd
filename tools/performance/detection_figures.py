"""The figure of the benchmark `detection`: milliseconds until a server counts as dead, against the number of servers, one panel for each load."""
from performance.plot import Axis, Canvas, Label, Panel, Picture, axis_around, decades, lay_out_panels, looks_of

LABEL_ROOM = 0.32  # of the axis, right of the last point


def series_of(rows, load):
    """(fault, detector) -> rows, by rising number of servers."""
    series = {}
    for row in rows:
        if row["load"] == load:
            series.setdefault(f"{row['fault']}, {row['detector']}", []).append(row)
    return {name: sorted(of_name, key=lambda row: row["servers"]) for name, of_name in series.items()}


def server_axis(rows):
    counts = sorted({row["servers"] for row in rows})
    low, high = 0.8 * counts[0], max(counts[-1], 2 * counts[0])
    return Axis(low, high * (high / low) ** (LABEL_ROOM / (1 - LABEL_ROOM)), counts)


def time_axis(rows):
    values = [max(0.01, value) for row in rows for value in (row["ms_min"], row["ms_max"])]
    return axis_around(values, max(1.0, decades(values)))


def draw(panel, series, looks):
    """A bar spans the trials; the marker stands at their median."""
    labels = []
    for name, rows in series.items():
        look = looks[name]
        panel.canvas.line([(panel.x(row["servers"]), panel.y(row["ms_median"])) for row in rows], look.colour, 2)
        for row in rows:
            x = panel.x(row["servers"])
            panel.canvas.line([(x, panel.y(max(0.01, row["ms_min"]))), (x, panel.y(row["ms_max"]))], look.colour)
            panel.canvas.marker(x, panel.y(row["ms_median"]), look, f"{row['servers']} servers, {name}: {row['ms_median']:.3g} ms")
        labels.append(Label(panel.x(rows[-1]["servers"]), panel.y(rows[-1]["ms_median"]), name, look.colour))
    panel.draw_labels(labels)


def pictures(rows):
    panels = {load: series_of(rows, load) for load in ("idle", "saturated")}
    panels = {load: series for load, series in panels.items() if series}
    looks = looks_of(list(dict.fromkeys(name for series in panels.values() for name in series)))
    height, boxes = lay_out_panels(len(panels))
    canvas = Canvas(height)
    for (load, series), box in zip(panels.items(), boxes):
        panel = Panel(canvas, *box, server_axis(rows), time_axis(rows))
        panel.draw_axes(f"servers: {load}", "servers", "ms until given up")
        draw(panel, series, looks)
    ends = ", ".join(f"{load}: {of_name[-1]['ms_median']:.3g} ms with {of_name[-1]['servers']} servers {name.replace(', ', ' and the detector ')}"
                     for load, series in panels.items() for name, of_name in series.items())
    alt = f"Milliseconds from the signal until a server is given up, medians and spans, against the number of servers, on logarithmic axes; {ends}."
    return [Picture("detection.svg", canvas.svg(alt), alt)]
