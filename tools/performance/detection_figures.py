"""The figure of the benchmark `detection`: milliseconds until a server counts as dead, against the number of servers, one panel for each load."""
from performance.plot import Picture, axis_around, decades
from performance.server_panels import Span, draw_panels, panels_of, server_axis

LABEL_ROOM = 0.32  # of the axis, right of the last point


def time_axis(rows):
    values = [max(0.01, value) for row in rows for value in (row["ms_min"], row["ms_max"])]
    return axis_around(values, max(1.0, decades(values)))


def span_of(row):
    return Span(row["ms_min"], row["ms_median"], row["ms_max"], f"{row['ms_median']:.3g} ms")


def pictures(rows):
    panels = panels_of(rows, "load", ("idle", "saturated"), lambda row: f"{row['fault']}, {row['detector']}")
    canvas = draw_panels(panels, ("servers", "ms until given up"), server_axis(rows, LABEL_ROOM), time_axis(rows), span_of)
    ends = ", ".join(f"{load}: {of_name[-1]['ms_median']:.3g} ms with {of_name[-1]['servers']} servers {name.replace(', ', ' and the detector ')}"
                     for load, series in panels.items() for name, of_name in series.items())
    alt = f"Milliseconds from the signal until a server is given up, medians and spans, against the number of servers, on logarithmic axes; {ends}."
    return [Picture("detection.svg", canvas.svg(alt), alt)]
