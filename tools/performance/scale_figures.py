"""The figure of the benchmark `scale`: efficiency against the number of servers, one panel for servers that are alike, one for those that are not."""
from performance.plot import SOFT, Axis, Picture
from performance.server_panels import Span, draw_panels, panels_of, server_axis

LABEL_ROOM = 0.28  # of the axis, right of the last point
TICKS = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]


def efficiency_axis(rows):
    lowest = max(0.01, min(row["efficiency_min"] for row in rows))
    highest = max(1.0, *(row["efficiency_max"] for row in rows))
    low, high = 0.95 * min(lowest, 0.9), 1.03 * highest
    return Axis(low, high, [tick for tick in TICKS if low <= tick <= high])


def span_of(row):
    return Span(row["efficiency_min"], row["efficiency"], row["efficiency_max"], f"{row['efficiency']:.3f}")


def draw_rule(panel):
    panel.canvas.line([(panel.left, panel.y(1)), (panel.right, panel.y(1))], SOFT, dash="5 4")


def pictures(rows):
    panels = panels_of(rows, "speeds", ("equal", "lognormal"), lambda row: row["schedule"] if row["kind"] == "ghosts" else "processes")
    canvas = draw_panels(panels, ("speeds", "efficiency"), server_axis(rows, LABEL_ROOM), efficiency_axis(rows), span_of, draw_rule)
    most = max(row["servers"] for row in rows)
    ends = ", ".join(f"{row['efficiency']:.2f} with {row['schedule']} and {row['speeds']} speeds"
                     for row in rows if row["servers"] == most and row["kind"] == "ghosts")
    alt = f"Efficiency against the number of servers, on logarithmic axes; at {most} servers: {ends}."
    return [Picture("scale-efficiency.svg", canvas.svg(alt), alt)]
