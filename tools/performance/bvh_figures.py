"""The figures of the benchmark `bvh`: how fast our trees are beside Embree, and what a step of a ray costs."""
import math
from statistics import median

from performance.plot import INK, LOOKS, SOFT, WIDTH, Canvas, Look, Panel, Picture, axis_around, decades, lay_out_panels, looks_of, spread

# What a step into a node or leaf usually takes a single ray on a server core with 2 MiB of second-level cache, by where the tree
# lives: below 2 MiB, in the third level, or beyond 100 MiB. Rulers to read the points by, not limits that no code could beat.
RULERS_NS = [(20, "L2"), (30, "L3"), (40, "DRAM")]

ROW_HEIGHT, SCENE_GAP, NAME_WIDTH = 17, 28, 150
TREE_OFFSET = 5  # between the trees of one line, so that equal ones do not hide each other
NAME_GAP = 70    # between the names of trees, from middle to middle
KEY_HEIGHT = 56
KIND_MARKERS = {"primary": "circle", "diffuse": "square", "incoherent": "triangle", "shadow": "diamond", "shadow3": "wedge"}


def distinct(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def of_first_threads(rows):
    return [row for row in rows if row["threads"] == rows[0]["threads"]]


def threads_in_words(rows):
    count = rows[0]["threads"]
    return f"{count} thread" + ("s" if count > 1 else "")


class RatioRows:
    """Where each scene and kind of rays stands in the plot of ratios: scenes as headings, a line for each kind below."""

    def __init__(self, rows, top):
        self.headings, self.places = [], {}
        y = top
        for scene in distinct(rows, "scene"):
            self.headings.append((scene, y))
            for kind in distinct([row for row in rows if row["scene"] == scene], "rays"):
                y += ROW_HEIGHT
                self.places[scene, kind] = y
            y += SCENE_GAP
        self.bottom = y - SCENE_GAP + ROW_HEIGHT / 2


def draw_ratio(panel, y, row, look):
    low, high = panel.x(row["ratio_min"]), panel.x(row["ratio_max"])
    panel.canvas.line([(low, y), (high, y)], look.colour, 1.5)
    for x in (low, high):
        panel.canvas.line([(x, y - 4), (x, y + 4)], look.colour, 1.5)
    hint = f"{row['scene']}, {row['rays']}, {row['ours']}: {row['ratio_vs_embree']:.3f} ({row['ratio_min']:.3f} to {row['ratio_max']:.3f})"
    panel.canvas.marker(panel.x(row["ratio_vs_embree"]), y, look, hint)


def ratio_axis(rows):
    ends = [1.0, *(row["ratio_min"] for row in rows), *(row["ratio_max"] for row in rows)]
    return axis_around(ends, max(0.5, decades(ends)), before=0.05, after=0.09)


def draw_ratios(rows, looks, peer, description):
    places = RatioRows(rows, top=50)
    canvas = Canvas(places.bottom + 46)
    panel = Panel(canvas, NAME_WIDTH, 30, WIDTH - NAME_WIDTH - 24, places.bottom - 30, ratio_axis(rows))
    panel.draw_axes("", f"rays per second, ours / {peer} (logarithmic; the bar is the smallest to the largest of the rounds)")
    for scene, y in places.headings:
        canvas.text(8, y + 4, scene, bold=True)
    for (_, kind), y in places.places.items():
        canvas.text(NAME_WIDTH - 10, y + 4, kind, SOFT, 11, "end")
    canvas.line([(panel.x(1), panel.top), (panel.x(1), panel.bottom)], INK, 1.5)
    canvas.text(panel.x(1), panel.top - 10, f"as fast as {peer}", anchor="middle")
    aside = {ours: TREE_OFFSET * (i - (len(looks) - 1) / 2) for i, ours in enumerate(looks)}
    for row in rows:
        draw_ratio(panel, places.places[row["scene"], row["rays"]] + aside[row["ours"]], row, looks[row["ours"]])
    first = [row for row in rows if (row["scene"], row["rays"]) == (rows[0]["scene"], rows[0]["rays"])]
    for row, x in zip(first, spread([panel.x(row["ratio_vs_embree"]) for row in first], NAME_GAP)):
        # The name of each tree once, above its topmost point.
        canvas.text(x, places.headings[0][1] + 4, row["ours"], looks[row["ours"]].colour, 12, "middle", True)
    return canvas.svg(description)


def ratio_picture(rows, peer):
    """None where the peer was not there."""
    rows = [row for row in of_first_threads(rows) if row["ratio_vs_embree"] is not None]
    if not rows:
        return None
    told = []
    for ours in distinct(rows, "ours"):
        ratios = [row["ratio_vs_embree"] for row in rows if row["ours"] == ours]
        mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
        told.append(f"{ours} {mean:.2f} times ({min(ratios):.2f} to {max(ratios):.2f})")
    alt = (f"Rays per second of our trees relative to {peer}, on {threads_in_words(rows)}, for each scene and kind of rays; "
           f"geometric mean and range: {'; '.join(told)}.")
    return Picture("bvh-ratio.svg", draw_ratios(rows, looks_of(distinct(rows, "ours")), peer, alt), alt)


def ns_per_ray(row):
    return 1e3 * row["threads"] / row["mrays_per_s"]


def draw_rulers(panel):
    """Straight lines of slope 1, from edge to edge of the panel; the number stands where the line ends."""
    for ns, _ in RULERS_NS:
        start = max(panel.x_axis.low, panel.y_axis.low / ns)
        end = min(panel.x_axis.high, panel.y_axis.high / ns)
        if start < end:
            places = [(panel.x(x), panel.y(ns * x)) for x in (start, end)]
            panel.canvas.line(places, SOFT, dash="5 4")
            panel.canvas.text(places[1][0] + 3, places[1][1] - 3, str(ns), SOFT, 9, "middle")


def step_look(row, trees):
    """Colour and filling tell the tree, the form tells the kind of rays."""
    place = trees.index(row["ours"])
    return Look(LOOKS[place % len(LOOKS)].colour, KIND_MARKERS.get(row["rays"], "circle"), hollow=place % 2 == 1)


def draw_key(canvas, kinds, trees):
    """Two lines over all panels: the kinds of rays; the trees and the rulers."""
    for i, kind in enumerate(kinds):
        canvas.marker(64 + 110 * i, 18, Look(INK, KIND_MARKERS.get(kind, "circle")), kind)
        canvas.text(74 + 110 * i, 22, kind)
    x = 64
    for tree in trees:
        look = step_look({"ours": tree, "rays": "primary"}, trees)
        canvas.marker(x, 40, look, tree)
        canvas.text(x + 10, 44, tree, look.colour, bold=True)
        x += 110
    canvas.line([(x - 4, 40), (x + 26, 40)], SOFT, dash="5 4")
    rulers = ", ".join(f"{ns} ({memory})" for ns, memory in RULERS_NS)
    canvas.text(x + 34, 44, f"ns per node, by where a tree lives: {rulers}", SOFT)


def draw_steps(rows, description):
    scenes, trees = distinct(rows, "scene"), distinct(rows, "ours")
    nodes = [row["nodes_per_ray"] for row in rows]
    times = [ns_per_ray(row) for row in rows]
    x_axis, y_axis = (axis_around(values, max(1.0, decades(values))) for values in (nodes, times))
    height, boxes = lay_out_panels(len(scenes), KEY_HEIGHT)
    canvas = Canvas(height)
    draw_key(canvas, distinct(rows, "rays"), trees)
    for scene, box in zip(scenes, boxes):
        panel = Panel(canvas, *box, x_axis, y_axis)
        panel.draw_axes(scene, "nodes visited per ray", "ns per ray")
        draw_rulers(panel)
        for row in rows:
            if row["scene"] == scene:
                hint = f"{row['ours']}, {row['rays']}: {row['nodes_per_ray']:.1f} nodes, {ns_per_ray(row):.0f} ns"
                canvas.marker(panel.x(row["nodes_per_ray"]), panel.y(ns_per_ray(row)), step_look(row, trees), hint)
    return canvas.svg(description)


def steps_picture(rows):
    rows = [row for row in of_first_threads(rows) if row["nodes_per_ray"]]
    if not rows:
        return None
    told = []
    for ours in distinct(rows, "ours"):
        costs = [ns_per_ray(row) / row["nodes_per_ray"] for row in rows if row["ours"] == ours]
        told.append(f"{ours} {min(costs):.0f} to {max(costs):.0f}, median {median(costs):.0f}")
    alt = (f"Nanoseconds per ray against nodes visited per ray, on {threads_in_words(rows)}, one panel for each scene, "
           f"with lines of 20, 30 and 40 ns per node. ns per node: {'; '.join(told)}.")
    return Picture("bvh-steps.svg", draw_steps(rows, alt), alt)


def pictures(rows, peer):
    drawn = [ratio_picture(rows, peer or "the peer"), steps_picture(rows)]
    return [picture for picture in drawn if picture]
