"""pathscope-bench as others use it: each benchmark in small, the keys of its JSON, figures that can be checked, and refusals.

    test_bench.py BIN      BIN: the folder of pathscope-bench

No figure is judged for speed: how fast a machine is depends on who else uses it.
"""
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
PATIENCE_S = 600
FILE_KEYS = {"bench", "machine", "commit", "build", "runs", "rows"}
RAY_KINDS = ["primary", "diffuse", "incoherent", "shadow", "shadow3"]
BVH_KEYS = {
    "scene", "triangles", "rays", "ray_count", "threads", "ours", "our_call", "our_calls", "mrays_per_s", "hit_fraction",
    "embree_mrays_per_s", "ratio_vs_embree", "ratio_min", "ratio_max", "embree_call", "embree_calls", "disagreements", "build_s",
    "embree_build_s", "build_cpu_s", "embree_build_cpu_s", "bytes_per_triangle", "embree_bytes_per_triangle", "nodes_per_ray", "boxes_per_ray", "triangles_per_ray"}
EMBREE_KEYS = {key for key in BVH_KEYS if "embree" in key} | {"ratio_min", "ratio_max", "disagreements"}
MOST_DISAGREEMENTS = 1e-3  # of the rays: those that pass within rounding of an edge


def run(*words):
    return subprocess.run([BIN / "pathscope-bench", *map(str, words)], capture_output=True, text=True, timeout=PATIENCE_S)


class Bench(unittest.TestCase):
    def measure(self, name, *words):
        """The file that a benchmark writes."""
        with tempfile.TemporaryDirectory(prefix="pathscope_bench_") as folder:
            path = pathlib.Path(folder) / "bench.json"
            done = run(name, "--json", path, *words)
            self.assertEqual(done.returncode, 0, done.stderr)
            file = json.loads(path.read_text())
        self.assertLessEqual(FILE_KEYS, set(file))
        self.assertEqual(file["bench"], name)
        self.assertGreaterEqual(file["runs"], 5)
        self.assertTrue(file["machine"] and file["commit"])
        return file

    def test_bvh(self):
        file = self.measure("bvh", "--scene", "scenes/cornell", "--rays", 4096)
        rows = file["rows"]
        for ours in {row["ours"] for row in rows}:
            self.assertEqual([row["rays"] for row in rows if row["ours"] == ours], RAY_KINDS)
        for row in rows:
            with self.subTest(rays=row["rays"], ours=row["ours"]):
                self.assertEqual(set(row), BVH_KEYS)
                self.assertEqual((row["scene"], row["triangles"], row["threads"], row["ray_count"]), ("cornell", 38, 1, 4096))
                self.assertGreater(row["mrays_per_s"], 0)
                self.assertTrue(0 < row["hit_fraction"] <= 1)
                self.check_embree(file, row)
        two_wide = [row for row in rows if row["ours"] == "two-wide"]
        for row in two_wide:  # A visit of an inner node tests two boxes, the root's own box is one more.
            self.assertTrue(0 < row["nodes_per_ray"] <= row["boxes_per_ray"] <= 2 * row["nodes_per_ray"] + 1, row)

    def check_embree(self, file, row):
        """A build without Embree says so by nulls; one with it must agree with Embree on nearly every ray."""
        if file["peer"] is None:
            self.assertEqual({row[key] for key in EMBREE_KEYS}, {None})
            return
        self.assertLessEqual(row["disagreements"], MOST_DISAGREEMENTS * row["ray_count"])
        self.assertLessEqual(row["ratio_min"], row["ratio_vs_embree"])
        self.assertLessEqual(row["ratio_vs_embree"], row["ratio_max"])
        self.assertEqual(row["embree_calls"][row["embree_call"]], row["embree_mrays_per_s"])

    def test_scenes_of_a_folder_and_one_by_path(self):
        rows = self.measure("bvh", "--scenes", "scenes", "--scene", "cornell", "--scene", "scenes/furnace/scene.json", "--rays", 256)["rows"]
        self.assertEqual({row["scene"] for row in rows}, {"cornell", "furnace"})

    def test_image(self):
        rows = self.measure("image", "--scene", "scenes/cornell", "--size", "32x32", "--spp", 4, "--reference-spp", 64)["rows"]
        self.assertEqual({row["setting"] for row in rows}, {"best", "textbook"})
        for row in rows:
            curve = row["rmse_at_s"]
            self.assertEqual([point["spp"] for point in curve], [1, 2, 4])
            self.assertGreater(curve[0]["rmse"], curve[-1]["rmse"])  # Half of it is expected: a wide margin.
            self.assertGreater(row["rays_per_s"], row["samples_per_s"])

    def test_filter(self):
        file = self.measure("filter", "--size", "64x64", "--threads", 1)
        rows = file["rows"]
        self.assertEqual({(row["width"], row["height"], row["threads"]) for row in rows}, {(64, 64, 1)})
        self.assertEqual([(row["variant"], row["radius"]) for row in rows],
                         [("joint_bilateral", 5), ("joint_bilateral", 7), ("atrous", 14), ("atrous", 62)])
        self.assertTrue(all(row["ms"] > 0 and row["cpu_ms"] > 0 for row in rows))
        self.assertEqual(file["errors"], [])

    def test_filter_errors(self):
        errors = self.measure("filter", "--size", "64x64", "--threads", 1, "--scene", "scenes/cornell", "--spp", 1,
                              "--reference-spp", 64)["errors"]
        self.assertEqual(len(errors), 5)
        for row in errors:
            # Four times at the least is expected, less the noise of the reference: a wide margin.
            self.assertLess(2 * row["rmse_after"], row["rmse_before"], row)
            self.assertLess(4 * row["rel_mse_after"], row["rel_mse_before"], row)

    def test_trace(self):
        words = ("--scene", "scenes/cornell", "--rays", 1024, "--kind", "shadow")
        rows = [self.measure("trace", *words, "--tree", tree, "--passes", passes)["rows"]
                for tree, passes in (("wide", 2), ("two-wide", 1), ("wide", 0))]
        self.assertEqual([[row["ours"] for row in one] for one in rows], [["wide"], ["two-wide"], ["wide"]])
        wide, two_wide, none = (one[0]["hits"] for one in rows)
        self.assertEqual((wide, none), (two_wide, 0))  # Both trees give the same answers.
        self.assertTrue(0 < wide < 1024)

    def test_limits(self):
        """The program itself checks that the circle of loads goes through the whole working set."""
        file = self.measure("limits")
        self.assertIn(file["simd"], {"portable", "avx2", "avx512"})
        rows = {limit: [row for row in file["rows"] if row["limit"] == limit] for limit in ("arithmetic", "bandwidth", "latency")}
        self.assertEqual(sum(map(len, rows.values())), len(file["rows"]))
        self.assertIn("portable", {row["simd"] for row in rows["arithmetic"]})
        self.assertTrue(all(row["gflops"] > 0 for row in rows["arithmetic"]))
        for limit, figure in (("bandwidth", "gb_per_s"), ("latency", "ns")):
            sizes = [row["bytes"] for row in rows[limit]]
            self.assertEqual(sizes, [32768 * 4**i for i in range(8)])
            self.assertTrue(all(row[figure] > 0 for row in rows[limit]))
        self.assertLess(rows["latency"][0]["ns"], rows["latency"][-1]["ns"])  # By a factor of fifty, usually.

    def test_ledger(self):
        # The program itself checks that every tile was committed once.
        rows = self.measure("ledger")["rows"]
        self.assertEqual({row["schedule"] for row in rows}, {"static", "weighted", "pull"})
        self.assertTrue(all(row["servers"] == 1000 and row["tiles_per_s"] > 0 for row in rows))

    def test_scale(self):
        # The program itself checks nothing; but a frame that lost a tile would never be complete.
        file = self.measure("scale", "--servers", "1,3", "--ghosts", 40, "--seconds", 0.1, "--scene", "scenes/cornell", "--spp", 1)
        rows = file["rows"]
        cases = [(row["servers"], row["kind"], row["schedule"], row["speeds"]) for row in rows]
        self.assertEqual(cases, [(n, "ghosts", schedule, speeds) for n in (1, 3) for schedule in ("pull", "static") for speeds in ("equal", "lognormal")] +
                         [(n, "processes", "pull", "equal") for n in (1, 3)])
        for row in rows:
            self.assertLessEqual(row["efficiency_min"], row["efficiency"], row)
            self.assertLessEqual(row["efficiency"], row["efficiency_max"], row)
            self.assertTrue(0 < row["efficiency_max"] < 1.1, row)  # Nobody is faster than its speed, but for a moment at the start.
            self.assertGreaterEqual(row["tiles"], 32, row)
        equal = [row["sum_of_speeds"] for row in rows if (row["kind"], row["speeds"]) == ("ghosts", "equal")]
        self.assertEqual(equal, [200e3, 200e3, 600e3, 600e3])
        crowd = file["crowd"]
        self.assertEqual((crowd["servers"], crowd["tiles"]), (40, 60 * 34))  # A round for each block of full HD: more than 32 for each ghost.
        self.assertTrue(all(crowd[key] > 0 for key in ("tiles_per_s", "tiles_per_main_cpu_s", "tiles_per_cpu_s", "join_s")), crowd)
        self.assertLessEqual(crowd["tiles_per_cpu_s"], crowd["tiles_per_main_cpu_s"])
        loopback = file["loopback"]
        self.assertTrue(0 < loopback["ratio_min"] <= loopback["ratio"] <= loopback["ratio_max"], loopback)

    def test_detection(self):
        file = self.measure("detection", "--scene", "scenes/cornell", "--servers", "2", "--seconds", 1)
        rows = {(row["servers"], row["load"], row["detector"], row["fault"]): row for row in file["rows"]}
        self.assertEqual(set(rows), {(servers, load, detector, fault) for servers, detector in ((2, "adaptive"), (8, "fixed"))
                                     for load in ("idle", "saturated") for fault in ("killed", "frozen")})
        for (_, load, detector, fault), row in rows.items():
            self.assertEqual((row["trials"], len(row["ms"])), (5, 5))
            self.assertTrue(0 < row["ms_min"] <= row["ms_median"] <= row["ms_p90"] <= row["ms_max"], row)
            # However slow the machine: a period must pass without a sign, and silence must have lasted before it means anything.
            least = {"fixed": 6000 - 100, "adaptive": 300 if fault == "frozen" else 0}[detector]
            self.assertGreaterEqual(row["ms_min"], least, row)
        self.assertEqual((file["watch"]["servers"], file["watch"]["seconds"]), (2, 1))

    def test_too_few_files_for_ghosts(self):
        few = lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (256, 256))  # noqa: E731
        done = subprocess.run([BIN / "pathscope-server", "--ghost", "1000"], capture_output=True, text=True, timeout=PATIENCE_S, preexec_fn=few)
        self.assertEqual(done.returncode, 1)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1)
        self.assertIn("open files", done.stderr)

    def test_refused(self):
        for words, named in ((["race"], "bvh"), (["bvh"], "--scenes"), (["bvh", "--scene", "nowhere"], "nowhere"),
                             (["ledger", "--rays", "1000"], "--rays"), (["filter", "--runs", "2"], "--runs"),
                             (["trace", "--scene", "scenes/cornell", "--kind", "light"], "shadow3"),
                             (["ledger", "--json", "no/where.json"], "no/where.json"),
                             (["bvh", "--scene", "scenes/cornell", "--threads", "1024"], "--threads")):
            with self.subTest(words):
                done = run(*words)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(len(done.stderr.strip().splitlines()), 1)
                self.assertIn(named, done.stderr)


if __name__ == "__main__":
    unittest.main()
