"""The figure of the benchmark `scale`: efficiency against the number of servers, one panel for servers that are alike, one for those that are not."""
from performance.plot import SOFT, Axis, Canvas, Label, Panel, Picture, lay_out_panels, looks_of

LABEL_ROOM = 0.28  # of the axis, right of the last point
TICKS = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]


def series_of(rows, speeds):
    """name -> points (servers, row), by rising number of servers."""
    series = {}
    for row in rows:
        if row["speeds"] == speeds:
            name = row["schedule"] if row["kind"] == "ghosts" else "processes"
            series.setdefault(name, []).append((row["servers"], row))
    return {name: sorted(points, key=lambda point: point[0]) for name, points in series.items()}


def server_axis(rows):
    """Powers of two with room on both sides; one number of servers alone stands near the left."""
    counts = sorted({row["servers"] for row in rows})
    low, high = 0.8 * counts[0], max(counts[-1], 2 * counts[0])
    return Axis(low, high * (high / low) ** (LABEL_ROOM / (1 - LABEL_ROOM)), counts)


def efficiency_axis(rows):
    lowest = max(0.01, min(row["efficiency_min"] for row in rows))
    highest = max(1.0, *(row["efficiency_max"] for row in rows))
    low, high = 0.95 * min(lowest, 0.9), 1.03 * highest
    return Axis(low, high, [tick for tick in TICKS if low <= tick <= high])


def draw(panel, series, looks):
    """A bar spans the rounds; the marker stands at their median."""
    panel.canvas.line([(panel.left, panel.y(1)), (panel.right, panel.y(1))], SOFT, dash="5 4")
    labels = []
    for name, points in series.items():
        panel.canvas.line([(panel.x(servers), panel.y(row["efficiency"])) for servers, row in points], looks[name].colour, 2)
        for servers, row in points:
            x = panel.x(servers)
            panel.canvas.line([(x, panel.y(max(0.01, row["efficiency_min"]))), (x, panel.y(row["efficiency_max"]))], looks[name].colour)
            panel.canvas.marker(x, panel.y(row["efficiency"]), looks[name], f"{servers} servers, {name}: {row['efficiency']:.3f}")
        servers, row = points[-1]
        labels.append(Label(panel.x(servers), panel.y(row["efficiency"]), name, looks[name].colour))
    panel.draw_labels(labels)


def pictures(rows):
    panels = {speeds: series_of(rows, speeds) for speeds in ("equal", "lognormal")}
    panels = {speeds: series for speeds, series in panels.items() if series}
    looks = looks_of(list(dict.fromkeys(name for series in panels.values() for name in series)))
    height, boxes = lay_out_panels(len(panels))
    canvas = Canvas(height)
    for (speeds, series), box in zip(panels.items(), boxes):
        panel = Panel(canvas, *box, server_axis(rows), efficiency_axis(rows))
        panel.draw_axes(f"speeds: {speeds}", "servers", "efficiency")
        draw(panel, series, looks)
    most = max(row["servers"] for row in rows)
    ends = ", ".join(f"{row['efficiency']:.2f} with {row['schedule']} and {row['speeds']} speeds"
                     for row in rows if row["servers"] == most and row["kind"] == "ghosts")
    alt = f"Efficiency against the number of servers, on logarithmic axes; at {most} servers: {ends}."
    return [Picture("scale-efficiency.svg", canvas.svg(alt), alt)]
