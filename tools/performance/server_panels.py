"""Figures against the number of servers: one panel for each kind of run, in it a line for each series, and a bar that spans the trials of each row."""
from typing import NamedTuple

from performance.plot import Axis, Canvas, Label, Panel, lay_out_panels, looks_of


class Span(NamedTuple):
    """Of the trials of a row."""
    low: float
    median: float
    high: float
    words: str  # For the hint at the marker.


def panels_of(rows, kind, kinds, name_of):
    """kind -> name of a series -> its rows, by rising number of servers; of the kinds that have rows."""
    panels = {}
    for one in kinds:
        of_kind = sorted((row for row in rows if row[kind] == one), key=lambda row: row["servers"])
        for name in dict.fromkeys(name_of(row) for row in rows if row[kind] == one):
            panels.setdefault(one, {})[name] = [row for row in of_kind if name_of(row) == name]
    return panels


def server_axis(rows, label_room):
    """With room on both sides, on the right for labels, a part of the axis; one number of servers alone stands near the left."""
    counts = sorted({row["servers"] for row in rows})
    low, high = 0.8 * counts[0], max(counts[-1], 2 * counts[0])
    return Axis(low, high * (high / low) ** (label_room / (1 - label_room)), counts)


def draw_series(panel, series, looks, span_of):
    """A bar spans the trials; the marker stands at their median."""
    labels = []
    for name, rows in series.items():
        look = looks[name]
        points = [(row["servers"], panel.x(row["servers"]), span_of(row)) for row in rows]
        panel.canvas.line([(x, panel.y(span.median)) for _, x, span in points], look.colour, 2)
        for servers, x, span in points:
            panel.canvas.line([(x, panel.y(max(0.01, span.low))), (x, panel.y(span.high))], look.colour)
            panel.canvas.marker(x, panel.y(span.median), look, f"{servers} servers, {name}: {span.words}")
        _, x, span = points[-1]
        labels.append(Label(x, panel.y(span.median), name, look.colour))
    panel.draw_labels(labels)


def draw_panels(panels, titles, x_axis, y_axis, span_of, before=lambda panel: None):
    """The canvas. titles: before a panel's kind, and of its vertical axis; before: what is drawn under the series."""
    looks = looks_of(list(dict.fromkeys(name for series in panels.values() for name in series)))
    height, boxes = lay_out_panels(len(panels))
    canvas = Canvas(height)
    for (kind, series), box in zip(panels.items(), boxes):
        panel = Panel(canvas, *box, x_axis, y_axis)
        panel.draw_axes(f"{titles[0]}: {kind}", "servers", titles[1])
        before(panel)
        draw_series(panel, series, looks, span_of)
    return canvas
