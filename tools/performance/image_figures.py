"""The figures of the benchmark `image`: error against samples and against processor time, and what each setting needs for one error."""
import math
from typing import NamedTuple

from performance.equal_error import common_error, need, ratio
from performance.plot import SOFT, Canvas, Label, Panel, Picture, axis_around, binary_ticks, decades, lay_out_panels, looks_of, round_ticks

BASELINE, CONTENDER = "textbook", "best"
LABEL_ROOM_PX = 86  # right of the curves
GUIDE_ABOVE = 1.8   # how far above all curves the guide runs


class Effort(NamedTuple):
    """What the x axis counts."""
    key: str
    title: str
    short: str
    ticks: object


SAMPLES = Effort("spp", "samples per pixel", "samples", binary_ticks)
CPU_TIME = Effort("cpu_s", "CPU seconds, all threads together", "CPU time", round_ticks)


def curves_of(rows, effort):
    """scene -> setting -> points (effort, rmse), on the first number of threads, for it changes neither axis.

    A point without an error, or at zero seconds, has no place on a logarithmic axis.
    """
    scenes = {}
    for row in rows:
        if row["threads"] == rows[0]["threads"]:
            points = [(point[effort.key], point["rmse"]) for point in row["rmse_at_s"]
                      if point["rmse"] is not None and point[effort.key] > 0]
            if points:
                scenes.setdefault(row["scene"], {})[row["setting"]] = points
    return scenes


def visible(points):
    return [point for point in points if point[1] > 0]


class Guide(NamedTuple):
    """error = level / sqrt(effort), between two efforts: the slope of plain Monte Carlo."""
    level: float
    start: float
    end: float

    def at(self, effort):
        return self.level / math.sqrt(effort)

    @staticmethod
    def above(points):
        efforts = [x for x, _ in points]
        return Guide(GUIDE_ABOVE * max(error * math.sqrt(x) for x, error in points), min(efforts), max(efforts))


def draw_scene(panel, curves, looks, guide, hint):
    labels = []
    if guide.end > guide.start:
        ends = [(panel.x(x), panel.y(guide.at(x))) for x in (guide.start, guide.end)]
        panel.canvas.line(ends, SOFT, dash="5 4")
        labels.append(Label(*ends[1], "slope −1/2", SOFT))
    for setting, points in curves.items():
        places = [(panel.x(x), panel.y(error)) for x, error in points]
        panel.canvas.line(places, looks[setting].colour, 2)
        for (x, y), (amount, error) in zip(places, points):
            panel.canvas.marker(x, y, looks[setting], f"{setting}: {amount:.4g} {hint}, RMSE {error:.4g}")
        labels.append(Label(*places[-1], setting, looks[setting].colour))
    panel.draw_labels(labels)


def draw_errors(scenes, looks, effort, description):
    """All panels span the same numbers of decades, so that a slope looks the same in each of them."""
    points = {scene: [point for curve in curves.values() for point in curve] for scene, curves in scenes.items()}
    guides = {scene: Guide.above(points[scene]) for scene in scenes}
    efforts = {scene: [x for x, _ in points[scene]] for scene in scenes}
    errors = {scene: [error for _, error in points[scene]] + [guides[scene].at(guides[scene].start)] for scene in scenes}
    x_span, y_span = (max(1.0, *map(decades, values.values())) for values in (efforts, errors))
    height, boxes = lay_out_panels(len(scenes))
    canvas = Canvas(height)
    for (scene, curves), box in zip(scenes.items(), boxes):
        x_axis = axis_around(efforts[scene], x_span, after=LABEL_ROOM_PX / box[2], ticks=effort.ticks)
        panel = Panel(canvas, *box, x_axis, axis_around(errors[scene], y_span))
        panel.draw_axes(scene, effort.title, "RMSE (linear radiance)")
        draw_scene(panel, curves, looks, guides[scene], effort.title)
    return canvas.svg(description)


def as_text(bounded, form):
    """A cell of a table: `form` is that of the amount, before which a bound stands."""
    return f"{bounded.bound} {bounded.amount:{form}}".strip() if bounded else "-"


class Comparison(NamedTuple):
    """What both settings need in a scene for the same error; ratio is that of the contender to the baseline."""
    scene: str
    error: float
    baseline: object
    contender: object
    ratio: object


def compare(scenes):
    """Of the scenes where both settings were measured."""
    comparisons = []
    for scene, curves in scenes.items():
        if {BASELINE, CONTENDER} <= set(curves):
            baseline, contender = curves[BASELINE], curves[CONTENDER]
            error = common_error(baseline, contender)
            needs = need(baseline, error), need(contender, error)
            comparisons.append(Comparison(scene, error, *needs, ratio(needs[1], needs[0])))
    return comparisons


def in_words(share):
    bound = {"<": "less than ", ">": "more than ", "": ""}[share.bound]
    return f"{bound}{share.amount:.2g}"


def describe(comparisons, effort):
    told = [f"{in_words(item.ratio)} in {item.scene}" for item in comparisons if item.ratio]
    result = f" For the same error, {CONTENDER} needs this share of the {effort.short} of {BASELINE}: {', '.join(told)}." if told else ""
    return f"RMSE against {effort.title}, on logarithmic axes, one panel for each scene.{result}"


def error_picture(rows, effort, name):
    """None if no error can be drawn."""
    scenes = {scene: {setting: visible(points) for setting, points in curves.items() if visible(points)}
              for scene, curves in curves_of(rows, effort).items()}
    scenes = {scene: curves for scene, curves in scenes.items() if curves}
    if not scenes:
        return None
    alt = describe(compare(curves_of(rows, effort)), effort)
    looks = looks_of(dict.fromkeys(row["setting"] for row in rows))
    return Picture(name, draw_errors(scenes, looks, effort, alt), alt)


def pictures(rows):
    drawn = [error_picture(rows, SAMPLES, "image-rmse-samples.svg"),
             error_picture(rows, CPU_TIME, "image-rmse-cpu.svg")]
    return [picture for picture in drawn if picture]


def equal_error_lines(rows):
    """Rows of text: scene, error, and for samples and CPU seconds: baseline, contender, ratio."""
    by_time = {item.scene: item for item in compare(curves_of(rows, CPU_TIME))}
    lines = []
    for item in compare(curves_of(rows, SAMPLES)):
        time = by_time.get(item.scene)
        times = [as_text(amount, ".3g") for amount in (time.baseline, time.contender, time.ratio)] if time else ["-"] * 3
        lines.append([item.scene, f"{item.error:.3g}", as_text(item.baseline, ",.1f"), as_text(item.contender, ",.1f"),
                      as_text(item.ratio, ".3g"), *times])
    return lines
