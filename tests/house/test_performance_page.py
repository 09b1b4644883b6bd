#!/usr/bin/env python3
"""The test of tools/performance-page: what it computes from curves, that its plots stand where their axes say, and what it refuses.

usage: test_performance_page.py
"""
import json
import math
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(PROJECT / "tools"))
sys.dont_write_bytecode = True

from performance import bvh_figures, detection_figures, image_figures, limit_figures, plot, scale_figures  # noqa: E402
from performance.equal_error import Need, common_error, need, ratio  # noqa: E402

SVG = "{http://www.w3.org/2000/svg}"
FILE = {"machine": "a machine", "commit": "0123", "build": "b", "runs": 5}


def monte_carlo(level, counts=(1, 2, 4, 8, 16)):
    """The curve of plain noise: error = level / sqrt(samples)."""
    return [(count, level / math.sqrt(count)) for count in counts]


def image_row(scene, setting, curve, cpu_s_per_sample=0.25):
    points = [{"spp": spp, "s": spp / 2, "cpu_s": spp * cpu_s_per_sample, "rmse": rmse} for spp, rmse in curve]
    return {"scene": scene, "setting": setting, "threads": 1, "spp": curve[-1][0], "samples_per_s": 1e6, "samples_per_cpu_s": 1e6,
            "rays_per_s": 1e6, "rmse_at_s": points}


def image_file(scenes):
    rows = [image_row(scene, setting, curve) for scene, curves in scenes.items() for setting, curve in curves.items()]
    return {**FILE, "bench": "image", "rows": rows}


def bvh_row(scene, kind, ours, mrays_per_s, nodes, ratios):
    """ratios: smallest, median and largest; nothing where the peer was not there."""
    low, middle, high = ratios or (None, None, None)
    embree = (lambda value: value if ratios else None)
    return {"scene": scene, "triangles": 38, "rays": kind, "threads": 1, "ours": ours, "mrays_per_s": mrays_per_s,
            "ratio_min": low, "ratio_vs_embree": middle, "ratio_max": high, "build_s": 1.0, "embree_build_s": embree(1.0),
            "our_calls": {"closest_hit": mrays_per_s}, "bytes_per_triangle": 70.0, "embree_bytes_per_triangle": embree(70.0), "nodes_per_ray": nodes, "boxes_per_ray": nodes,
            "triangles_per_ray": 1.0}


def bvh_file(rows, peer="embree 3.13.5"):
    return {**FILE, "bench": "bvh", "peer": peer, "summary": [], "rows": rows}


def limits_file(gflops=100.0, gb_per_s=(64.0, 8.0), ns=(2.0, 80.0)):
    """A machine whose first cache holds 32 KiB, and whose memory is slow."""
    rows = [{"limit": "arithmetic", "simd": "portable", "gflops": 1.0}, {"limit": "arithmetic", "simd": "avx2", "gflops": gflops}]
    for i, size in enumerate((32768, 131072)):
        rows += [{"limit": "bandwidth", "bytes": size, "gb_per_s": gb_per_s[i]}, {"limit": "latency", "bytes": size, "ns": ns[i]}]
    return {**FILE, "bench": "limits", "simd": "avx2", "rows": rows}


def scale_row(servers, schedule, speeds, efficiency, kind="ghosts"):
    return {"servers": servers, "schedule": schedule, "speeds": speeds, "kind": kind, "efficiency": efficiency,
            "efficiency_min": 0.9 * efficiency, "efficiency_max": min(1.0, 1.1 * efficiency), "s": 2.0}


SCALE_ROWS = [scale_row(servers, schedule, speeds, 1.0 if schedule == "pull" or speeds == "equal" else 1 / servers)
              for servers in (1, 2, 4) for schedule in ("pull", "static") for speeds in ("equal", "lognormal")]


def scale_file(crowd=None, loopback=None):
    return {**FILE, "bench": "scale", "rows": SCALE_ROWS, "crowd": crowd, "loopback": loopback}


def detection_row(servers, load, fault, ms, detector="adaptive"):
    return {"servers": servers, "load": load, "detector": detector, "fault": fault, "trials": 5, "ms_median": ms, "ms_p90": 1.5 * ms,
            "ms_min": 0.5 * ms, "ms_max": 2 * ms, "false_deaths": 0, "ms": [ms]}


DETECTION_ROWS = [detection_row(servers, load, fault, ms * servers) for servers in (1, 8) for load in ("idle", "saturated")
                  for fault, ms in (("killed", 2.0), ("frozen", 700.0))] + [detection_row(8, "idle", "killed", 9000.0, "fixed")]


class EqualError(unittest.TestCase):
    def test_noise_is_met_between_the_points(self):
        # Half the noise at every count needs a quarter of the samples: error = 1 / sqrt(n) is 0.3 at n = 1 / 0.09.
        for error in (0.3, 0.5, 0.7071, 0.26):
            with self.subTest(error=error):
                found = need(monte_carlo(1), error)
                self.assertEqual(found.bound, "")
                self.assertAlmostEqual(found.amount, 1 / error**2, places=9)
        self.assertAlmostEqual(need([(1, 1), (16, 1 / 16)], 0.5).amount, 2)  # Of slope -1 too.

    def test_a_measured_point_is_met_exactly(self):
        for count, error in monte_carlo(1):
            self.assertEqual(need(monte_carlo(1), error), Need("", count))

    def test_outside_of_what_was_measured_it_is_a_bound(self):
        self.assertEqual(need(monte_carlo(1), 2), Need("<", 1))
        self.assertEqual(need(monte_carlo(1), 0.2), Need(">", 16))
        self.assertEqual(need([(4, 0.5)], 0.6), Need("<", 4))
        self.assertEqual(need([(1, 0.5), (2, 0)], 0.1), Need("<", 2))

    def test_a_curve_that_rises_again_has_not_arrived(self):
        curve = [(1, 1), (2, 0.4), (4, 0.8), (8, 0.2)]
        self.assertAlmostEqual(need(curve, 0.4).amount, 4 * 2**0.5)  # Half way down from 0.8 to 0.2, not at 2.

    def test_ratio(self):
        self.assertEqual(ratio(Need("", 2), Need("", 8)), Need("", 0.25))
        self.assertEqual(ratio(Need("<", 1), Need("", 16)), Need("<", 1 / 16))
        self.assertEqual(ratio(Need("", 16), Need("<", 1)), Need(">", 16))
        self.assertEqual(ratio(Need(">", 16), Need("<", 1)), Need(">", 16))
        self.assertIsNone(ratio(Need("<", 1), Need("<", 1)))

    def test_common_error_is_where_the_shorter_curve_ends(self):
        self.assertEqual(common_error(monte_carlo(1), monte_carlo(0.5)), 0.25)
        self.assertEqual(common_error(monte_carlo(0.5), monte_carlo(1)), 0.25)

    def test_lines_of_the_table(self):
        lines = image_figures.equal_error_lines(image_file({
            "half": {"textbook": monte_carlo(1), "best": monte_carlo(0.5)},
            "worse": {"textbook": monte_carlo(1), "best": monte_carlo(2)},
            "far": {"textbook": monte_carlo(1), "best": monte_carlo(0.1)},
            "alone": {"best": monte_carlo(1)}})["rows"])
        self.assertEqual(lines, [["half", "0.25", "16.0", "4.0", "0.25", "4", "1", "0.25"],
                                 ["worse", "0.5", "4.0", "16.0", "4", "1", "4", "4"],
                                 ["far", "0.25", "16.0", "< 1.0", "< 0.0625", "4", "< 0.25", "< 0.0625"]])


class Axes(unittest.TestCase):
    def test_place(self):
        axis = plot.Axis(0.01, 100, [])
        for value, place in ((0.01, 0), (0.1, 0.25), (1, 0.5), (100, 1)):
            self.assertAlmostEqual(axis.place(value), place)

    def test_values_stand_in_the_middle_of_the_span(self):
        axis = plot.axis_around([1, 100], span=4, before=0.1, after=0.3)
        self.assertAlmostEqual(axis.place(0.1), 0.1)
        self.assertAlmostEqual(axis.place(1000), 0.7)

    def test_ticks(self):
        self.assertEqual([round(tick, 9) for tick in plot.round_ticks(0.03, 3)], [0.05, 0.1, 0.2, 0.5, 1, 2])
        self.assertEqual(plot.round_ticks(0.5, 2e5), [1, 10, 100, 1e3, 1e4, 1e5])
        self.assertLessEqual(len(plot.round_ticks(1e-9, 1e9)), 8)
        self.assertEqual(plot.binary_ticks(0.9, 20), [1, 2, 4, 8, 16])
        self.assertEqual(plot.binary_ticks(0.9, 5000), [1, 4, 16, 64, 256, 1024, 4096])

    def test_tick_text(self):
        told = [plot.tick_text(value) for value in (1, 0.5, 0.001, 2000, 5e-4, 1e-7, 1e5)]
        self.assertEqual(told, ["1", "0.5", "0.001", "2,000", "5·10⁻⁴", "10⁻⁷", "10⁵"])

    def test_labels_are_spread_no_more_than_they_must(self):
        self.assertEqual(plot.spread([100, 0], gap=10), [100, 0])
        self.assertEqual(plot.spread([50, 50], gap=10), [45, 55])
        self.assertEqual(plot.spread([4, 0, 30], gap=10), [7, -3, 30])
        self.assertEqual(plot.spread([0, 6, 12], gap=10), [-4, 6, 16])


def parse(picture):
    return ElementTree.fromstring(picture.svg)


def markers(picture):
    """hint -> (x, y) of every marker."""
    found = {}
    for group in parse(picture).iter(SVG + "g"):
        place = re.match(r"translate\((\S+) (\S+)\)", group.get("transform"))
        found[group.find(SVG + "title").text] = (float(place.group(1)), float(place.group(2)))
    return found


def words(picture):
    return [text.text for text in parse(picture).iter(SVG + "text")]


def dashed_lines(picture):
    """Of each dashed line: its first and last point."""
    paths = [path.get("d") for path in parse(picture).iter(SVG + "path") if path.get("stroke-dasharray")]
    points = [[tuple(map(float, point.split(","))) for point in path[1:].split("L")] for path in paths]
    return [(line[0], line[-1]) for line in points]


def above(line, point):
    """By how many pixels a line passes above a point."""
    (x0, y0), (x1, y1) = line
    return point[1] - (y0 + (y1 - y0) * (point[0] - x0) / (x1 - x0))


class Pictures(unittest.TestCase):
    SCENES = {"box & <ball>": {"textbook": monte_carlo(1), "best": monte_carlo(0.5)},
              "dim": {"textbook": monte_carlo(1e-3), "best": monte_carlo(1e-4)}}

    def test_errors(self):
        samples, cpu_time = image_figures.pictures(image_file(self.SCENES)["rows"])
        self.assertEqual((samples.name, cpu_time.name), ("image-rmse-samples.svg", "image-rmse-cpu.svg"))
        for picture in samples, cpu_time:
            self.assertEqual(len(markers(picture)), 20)
            for told in "box & <ball>", "dim", "RMSE (linear radiance)", "slope −1/2":
                self.assertIn(told, words(picture))
            self.assertEqual([words(picture).count(setting) for setting in ("textbook", "best")], [2, 2])
        self.assertIn("needs this share of the samples of textbook: 0.25 in box & <ball>, less than 0.062 in dim.", samples.alt)

    def test_equal_slopes_look_equal_in_every_panel(self):
        """Both scenes fall by -1/2, so 16 times the samples must go down by as many pixels, whatever the level."""
        places = markers(image_figures.pictures(image_file(self.SCENES)["rows"])[0])
        falls = [places[f"textbook: 16 samples per pixel, RMSE {level / 4:.4g}"][1] - places[f"textbook: 1 samples per pixel, RMSE {level:.4g}"][1]
                 for level in (1, 1e-3)]
        self.assertGreater(falls[0], 20)
        self.assertAlmostEqual(falls[0], falls[1], delta=0.11)

    def test_points_stand_at_the_ticks_of_their_values(self):
        picture = image_figures.pictures(image_file({"box": {"textbook": monte_carlo(1)}})["rows"])[0]
        ticks = {text.text: (float(text.get("x")), float(text.get("y"))) for text in parse(picture).iter(SVG + "text")}
        x, y = markers(picture)["textbook: 4 samples per pixel, RMSE 0.5"]
        self.assertEqual(ticks["4"][0], x)
        self.assertAlmostEqual(ticks["0.5"][1], y + 4, delta=0.11)  # A base line is below the middle of its digits.

    def test_the_guide_runs_along_plain_noise(self):
        picture = image_figures.pictures(image_file({"box": {"textbook": monte_carlo(1)}})["rows"])[0]
        guide, = dashed_lines(picture)
        heights = [above(guide, place) for place in markers(picture).values()]
        self.assertGreater(min(heights), 10)
        self.assertLess(max(heights) - min(heights), 0.3)

    def test_any_number_of_scenes_and_of_points(self):
        for count in (1, 2, 3, 5, 8):
            scenes = {f"scene{i}": {"textbook": monte_carlo(1), "best": monte_carlo(0.5)} for i in range(count)}
            picture = image_figures.pictures(image_file(scenes)["rows"])[0]
            height = float(parse(picture).get("height"))
            self.assertTrue(all(0 < x < plot.WIDTH and 0 < y < height for x, y in markers(picture).values()))
            self.assertTrue(all(f"scene{i}" in words(picture) for i in range(count)))
        single = {"one": {"textbook": [(1, 0.5)], "best": [(1, 0.5)]}}
        self.assertEqual(len(image_figures.pictures(image_file(single)["rows"])), 2)

    def test_an_error_of_zero_is_left_out(self):
        scenes = {"furnace": {"textbook": [(1, 0.1), (2, 0.0)], "best": [(1, 0.0), (2, 0.0)]}}
        self.assertEqual(list(markers(image_figures.pictures(image_file(scenes)["rows"])[0])), ["textbook: 1 samples per pixel, RMSE 0.1"])
        black = {"black": {"textbook": [(1, 0.0)], "best": [(1, 0.0)]}}
        self.assertEqual(image_figures.pictures(image_file(black)["rows"]), [])

    def test_rays(self):
        rows = [bvh_row("box", "primary", "wide", 10, 5, (0.5, 1, 2)), bvh_row("box", "shadow", "wide", 5, 10, (0.7, 0.8, 0.9))]
        ratios, steps = bvh_figures.pictures(rows, "embree 3.13.5")
        at_one = [place[0] for hint, place in markers(ratios).items() if ": 1.000" in hint]
        line = [path.get("d") for path in parse(ratios).iter(SVG + "path") if path.get("stroke") == plot.INK]
        self.assertEqual([float(re.match(r"M([\d.]+),", path).group(1)) for path in line], at_one)
        self.assertIn("wide 0.89 times (0.80 to 1.00)", ratios.alt)
        # 100 ns at 5 nodes and 200 ns at 10: both stand on the lowest ruler, that of 20 ns per node.
        places = [markers(steps)[hint] for hint in ("wide, primary: 5.0 nodes, 100 ns", "wide, shadow: 10.0 nodes, 200 ns")]
        _, *rulers = dashed_lines(steps)  # The first belongs to the key.
        self.assertEqual(len(rulers), 3)
        for place in places:
            heights = sorted(above(ruler, place) for ruler in rulers)
            self.assertAlmostEqual(heights[0], 0, delta=0.3)
            self.assertGreater(heights[1], 5)
        self.assertIn("wide 20 to 20, median 20", steps.alt)

    def test_without_the_peer_there_is_no_ratio(self):
        drawn = bvh_figures.pictures([bvh_row("box", "primary", "wide", 10, 5, None)], None)
        self.assertEqual([picture.name for picture in drawn], ["bvh-steps.svg"])


    def test_scale(self):
        picture, = scale_figures.pictures(SCALE_ROWS + [scale_row(2, "pull", "equal", 0.9, "processes")])
        places = markers(picture)
        self.assertEqual(len(places), 3 + 3 + 2 + 1)  # By their hints: those of both panels that are alike count once.
        self.assertLess(places["2 servers, processes: 0.900"][0], places["2 servers, static: 0.500"][0])  # The left panel, and the right one.
        falls = [places[f"{servers} servers, static: {1 / servers:.3f}"][1] for servers in (2, 4)]
        self.assertGreater(falls[1], falls[0])
        self.assertEqual(words(picture).count("efficiency"), 2)
        self.assertIn("0.25 with static and lognormal speeds", picture.alt)
        for rows in (SCALE_ROWS[:1], [row for row in SCALE_ROWS if row["speeds"] == "equal"]):
            picture, = scale_figures.pictures(rows)
            height = float(parse(picture).get("height"))
            self.assertTrue(all(0 < x < plot.WIDTH and 0 < y < height for x, y in markers(picture).values()))


class Floors(unittest.TestCase):
    def row(self, triangles=38, **changes):
        return {**bvh_row("box", "shadow", "wide", 5, 3, None), "triangles": triangles, "boxes_per_ray": 16.0, "triangles_per_ray": 8.0, **changes}

    def test_by_hand(self):
        """16 boxes are two nodes, 8 triangles one block: 592 operations, 832 bytes and three loads. 38 * 70 bytes fit 32 KiB."""
        time, = limit_figures.ray_times([self.row()], limits_file())
        self.assertEqual((time.measured, time.floors), (200, (5.92, 13, 6)))
        self.assertEqual((time.largest, round(time.times_above, 3)), ("bandwidth", round(200 / 13, 3)))

    def test_a_larger_tree_pays_what_its_memory_costs(self):
        for triangles in (1000, 1_000_000):  # Fits the second size; fits none, and the last one counts.
            time, = limit_figures.ray_times([self.row(triangles)], limits_file())
            self.assertEqual((time.floors, time.measured), ((5.92, 104, 240), 200))
            self.assertEqual((time.largest, time.times_above), ("bandwidth", 200 / 104))  # 240 ns are refuted by 200.
            slow, = limit_figures.ray_times([self.row(triangles, our_calls={"closest_hit": 2.0})], limits_file())
            self.assertEqual((slow.largest, slow.times_above), ("dependent loads", 500 / 240))

    def test_a_time_below_all_floors(self):
        time, = limit_figures.ray_times([self.row(our_calls={"closest_hit": 1000.0})], limits_file())
        self.assertEqual((time.largest, time.times_above), ("none", None))
        self.assertIn("1 to 1 times", limit_figures.picture([time]).alt)

    def test_single_rays_of_the_wide_tree_on_the_first_number_of_threads(self):
        rows = [self.row(), self.row(ours="two-wide"), self.row(threads=2), self.row(nodes_per_ray=None, boxes_per_ray=None),
                self.row(rays="primary", our_calls={"closest_hit": 4.0, "closest_hits": 16.0}, mrays_per_s=16.0)]
        self.assertEqual([(time.kind, time.measured) for time in limit_figures.ray_times(rows, limits_file())], [("shadow", 200), ("primary", 250)])

    def test_picture(self):
        times = limit_figures.ray_times([self.row(), self.row(rays="primary", triangles=1000)], limits_file())
        picture = limit_figures.picture(times)
        places = markers(picture)
        x = [places[f"box, shadow: {what} ns"][0] for what in ("arithmetic 5.92", "dependent loads 6", "bandwidth 13", "measured 200")]
        self.assertEqual(x, sorted(x))
        self.assertAlmostEqual(x[3], places["box, primary: measured 200 ns"][0])
        self.assertIn("arithmetic for 0, bandwidth for 2, dependent loads for 0 of 2", picture.alt)
        self.assertIn("1.9 to 15 times", picture.alt)


class Page(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pathscope_page_")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.page = self.folder / "performance.md"
        text = (PROJECT / "docs" / "performance.md").read_text(encoding="utf-8")
        without_figures = re.sub(r"(<!-- figures: \w+ -->\n).*?(<!-- end -->)", r"\1\2", text, flags=re.DOTALL)
        self.page.write_text(without_figures, encoding="utf-8")

    def write(self, *files):
        paths = []
        for i, file in enumerate(files):
            paths.append(self.folder / f"{i}.json")
            paths[-1].write_text(file if isinstance(file, str) else json.dumps(file), encoding="utf-8")
        return subprocess.run([sys.executable, "-B", PROJECT / "tools" / "performance-page", "--docs", self.folder, *paths],
                              capture_output=True, text=True)

    def test_shows_what_it_writes_and_keeps_the_rest(self):
        before = self.page.read_text(encoding="utf-8")
        files = image_file(Pictures.SCENES), bvh_file([bvh_row("box", "primary", "wide", 10, 5, (0.5, 0.6, 0.7))])
        for _ in range(2):  # The second time replaces the first.
            done = self.write(*files)
            self.assertEqual(done.returncode, 0, done.stderr)
        after = self.page.read_text(encoding="utf-8")
        shown = re.findall(r"!\[[^\]]{80,}\]\((images/[\w-]+\.svg)\)", after)
        self.assertEqual(sorted(shown), sorted(f"images/{path.name}" for path in (self.folder / "images").iterdir()))
        self.assertEqual(len(shown), 4)
        self.assertIn("| box & <ball> | 0.25 | 16.0 | 4.0 | 0.25 | 4 | 1 | 0.25 |", after)
        sections = re.compile(r"(<!-- figures: (?:bvh|image) -->\n).*?(<!-- end -->)", re.DOTALL)
        self.assertEqual(sections.sub(r"\1\2", after), sections.sub(r"\1\2", before))

    def test_scale_with_and_without_its_parts(self):
        crowd = {"servers": 1000, "tiles": 32000, "tiles_per_s": 15000.0, "tiles_per_main_cpu_s": 20000.0, "tiles_per_cpu_s": 12000.0,
                 "join_s": 1.5, "client_kib_per_server": 120.0}
        loopback = {"ratio": 0.98, "ratio_min": 0.95, "ratio_max": 1.01}
        for file, told in ((scale_file(), []), (scale_file(crowd), ["| 32,000 | 15,000 | 20,000 | 12,000 | 1.50 | 120 |"]),
                           (scale_file(crowd, loopback), ["0.980 (0.950 to 1.010)"])):
            done = self.write(file)
            self.assertEqual(done.returncode, 0, done.stderr)
            page = self.page.read_text(encoding="utf-8")
            for words_told in ["| 4 | ghosts | static | lognormal | 0.250 | 0.225 | 0.275 | 2.00 |", "(images/scale-efficiency.svg)", *told]:
                self.assertIn(words_told, page)

    def test_detection(self):
        picture, = detection_figures.pictures(DETECTION_ROWS)
        places = markers(picture)
        self.assertEqual(len(places), 2 * 2 + 1)  # By their hints: those of both panels that are alike count once.
        self.assertLess(places["8 servers, frozen, adaptive: 5.6e+03 ms"][1], places["8 servers, killed, adaptive: 16 ms"][1])
        self.assertIn("idle: 9e+03 ms with 8 servers killed and the detector fixed", picture.alt)
        done = self.write({**FILE, "bench": "detection", "rows": DETECTION_ROWS, "watch": {"servers": 8, "seconds": 600.0, "false_deaths": 0}})
        self.assertEqual(done.returncode, 0, done.stderr)
        page = self.page.read_text(encoding="utf-8")
        for words_told in ("| 8 | saturated | adaptive | killed | 5 | 16.0 | 24.0 | 8.0 | 32.0 | 0 |", "(images/detection.svg)", "watched for 600 s: 0 given up"):
            self.assertIn(words_told, page)

    def test_limits_beside_the_rays_that_they_bound(self):
        bvh = bvh_file([bvh_row("box", "shadow", "wide", 5, 3, None)])
        done = self.write(limits_file(), bvh)
        self.assertEqual(done.returncode, 0, done.stderr)
        page = self.page.read_text(encoding="utf-8")
        self.assertIn("(images/bvh-limits.svg)", page)
        self.assertIn("| latency | 128 KiB | 80.0 ns |", page)
        self.assertIn("| box | shadow | 200 |", page)
        large = bvh_file([{**bvh_row("box", "shadow", "wide", 5, 3, None), "triangles": 1000}])
        self.assertEqual(self.write(limits_file(), large).returncode, 0)
        self.assertIn("| (240) | bandwidth |", self.page.read_text(encoding="utf-8"))
        for files, named in (([limits_file()], "file of bvh"), ([limits_file(), {**bvh, "machine": "another"}], "another")):
            done = self.write(*files)
            self.assertEqual((done.returncode, len(done.stderr.strip().splitlines())), (2, 1), done.stderr)
            self.assertIn(named, done.stderr)

    def test_instructions_before_and_after(self):
        rows = [{"scene": "box", "rays": "shadow", "ours": ours, "instructions_per_ray": count} for ours, count in (("two-wide", 1000.0), ("wide", 250.4))]
        done = self.write({**FILE, "bench": "instructions", "peer": "valgrind-3.19.0", "simd": "avx2", "rows": rows})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("| box | shadow | 1,000 | 250 | 0.25 |", self.page.read_text(encoding="utf-8"))

    def test_refused_in_one_sentence_and_nothing_written(self):
        before = self.page.read_bytes()
        good, old = image_file(Pictures.SCENES), image_file(Pictures.SCENES)
        del old["rows"][0]["rmse_at_s"][0]["cpu_s"]
        for bad, named in (("{", "1.json"), ({"bench": "race"}, "race"), (old, "cpu_s"), ({**good, "rows": []}, "1.json")):
            with self.subTest(named):
                done = self.write(good, bad)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(len(done.stderr.strip().splitlines()), 1)
                self.assertIn(named, done.stderr)
                self.assertEqual(self.page.read_bytes(), before)
                self.assertFalse((self.folder / "images").exists())

    def test_a_page_without_a_place(self):
        self.page.write_text("# Performance\n", encoding="utf-8")
        done = self.write(image_file(Pictures.SCENES))
        self.assertEqual(done.returncode, 2)
        self.assertIn("0 places", done.stderr)
        self.page.unlink()
        self.assertIn("performance.md", self.write(image_file(Pictures.SCENES)).stderr)


if __name__ == "__main__":
    unittest.main()
