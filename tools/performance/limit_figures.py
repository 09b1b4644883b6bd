"""How far single rays through the wide tree are from what the machine can do: the floors under a ray's time, and the time.

Works on the rows of two files: `bvh`, what a ray visits and how long it takes, and `limits`, what a core can do. What the three floors
mean, and what they do not, is said in docs/performance.md.

Test: tests/house/test_performance_page.py
"""
from typing import NamedTuple

from performance.plot import INK, LOOKS, SOFT, WIDTH, Canvas, Panel, Picture, axis_around, decades

BOX_OPERATIONS = 19  # Six products, six sums, three maxima, three minima and a comparison (wide_kernel.hpp).
TRIANGLE_OPERATIONS = 36  # Of one that is missed: 21 to see its corners along the ray, 9 for its edges, 6 to compare them.
LANES, NODE_BYTES, BLOCK_BYTES = 8, 256, 320  # wide_bvh.hpp
FLOORS = ["arithmetic", "bandwidth", "dependent loads"]
ROW_HEIGHT, SCENE_GAP, NAME_WIDTH, TOP = 17, 28, 150, 60


class RayTime(NamedTuple):
    """Nanoseconds of one ray; floors in the order of FLOORS."""
    scene: str
    kind: str
    measured: float
    floors: tuple

    @property
    def held(self):
        """The floors that the time measured did not refute by being below them, by name."""
        return {name: floor for name, floor in zip(FLOORS, self.floors) if floor <= self.measured}

    @property
    def largest(self):
        return max(self.held, key=self.held.get, default="none")

    @property
    def times_above(self):
        return self.measured / max(self.held.values()) if self.held else None


class Limits:
    def __init__(self, file):
        of = {limit: [row for row in file["rows"] if row["limit"] == limit] for limit in ("arithmetic", "bandwidth", "latency")}
        self.gflops = {row["simd"]: row["gflops"] for row in of["arithmetic"]}[file["simd"]]
        self.bandwidth = {row["bytes"]: row["gb_per_s"] for row in of["bandwidth"]}
        self.latency = {row["bytes"]: row["ns"] for row in of["latency"]}

    @staticmethod
    def at(rates, tree_bytes):
        """Of the smallest working set measured that the tree fits in, or the largest."""
        return rates[min((size for size in rates if size >= tree_bytes), default=max(rates))]

    def floors(self, row):
        tree_bytes = row["triangles"] * row["bytes_per_triangle"]
        operations = row["boxes_per_ray"] * BOX_OPERATIONS + row["triangles_per_ray"] * TRIANGLE_OPERATIONS
        touched = (row["boxes_per_ray"] * NODE_BYTES + row["triangles_per_ray"] * BLOCK_BYTES) / LANES
        return (operations / self.gflops, touched / self.at(self.bandwidth, tree_bytes),
                row["nodes_per_ray"] * self.at(self.latency, tree_bytes))


def ray_times(bvh_rows, limits_file):
    """Of the wide tree on the first number of threads, by its call for single rays: packets share their loads."""
    limits = Limits(limits_file)
    times = []
    for row in bvh_rows:
        if row["ours"] == "wide" and row["threads"] == bvh_rows[0]["threads"] and row["boxes_per_ray"]:
            single = next(iter(row["our_calls"].values()))
            times.append(RayTime(row["scene"], row["rays"], 1e3 * row["threads"] / single, limits.floors(row)))
    return times


def draw(times, description):
    values = [value for time in times for value in (time.measured, *time.floors)]
    scenes = list(dict.fromkeys(time.scene for time in times))
    bottom = TOP + len(times) * ROW_HEIGHT + len(scenes) * SCENE_GAP
    canvas = Canvas(bottom + 46)
    panel = Panel(canvas, NAME_WIDTH, 40, WIDTH - NAME_WIDTH - 24, bottom - 40, axis_around(values, max(1.0, decades(values))))
    panel.draw_axes("", "ns per ray (logarithmic); the bar goes from the largest floor that holds to what was measured")
    for i, (floor, look) in enumerate(zip(FLOORS, LOOKS[1:])):
        canvas.marker(NAME_WIDTH + 160 * i, 18, look, floor)
        canvas.text(NAME_WIDTH + 160 * i + 10, 22, floor, look.colour, bold=True)
    canvas.marker(NAME_WIDTH + 160 * len(FLOORS), 18, LOOKS[0], "measured")
    canvas.text(NAME_WIDTH + 160 * len(FLOORS) + 10, 22, "measured", LOOKS[0].colour, bold=True)
    y = TOP
    for scene in scenes:
        canvas.text(8, y + 4, scene, INK, bold=True)
        for time in [time for time in times if time.scene == scene]:
            y += ROW_HEIGHT
            canvas.text(NAME_WIDTH - 10, y + 4, time.kind, SOFT, 11, "end")
            canvas.line([(panel.x(max(time.held.values(), default=time.measured)), y), (panel.x(time.measured), y)], SOFT, 1.5)
            for floor, value, look in [*zip(FLOORS, time.floors, LOOKS[1:]), ("measured", time.measured, LOOKS[0])]:
                canvas.marker(panel.x(value), y, look, f"{time.scene}, {time.kind}: {floor} {value:.3g} ns")
        y += SCENE_GAP
    return canvas.svg(description)


def picture(times):
    above = [time.times_above for time in times if time.held] or [1]
    counts = ", ".join(f"{floor} for {sum(time.largest == floor for time in times)}" for floor in FLOORS)
    alt = (f"Nanoseconds per ray of the wide tree, and the floors under them by arithmetic, bandwidth and dependent loads, for each scene and kind of "
           f"rays. The largest floor that the time measured does not refute is {counts} of {len(times)}; the time is {min(above):.2g} to {max(above):.2g} times that floor.")
    return Picture("bvh-limits.svg", draw(times, alt), alt)
