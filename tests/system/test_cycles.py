"""tools/compare-cycles: its arithmetic, its reader of scenes, its refusals, and where Blender is there one small comparison.

    test_cycles.py BIN      BIN: the folder of pathscope-render

No figure is judged for speed or noise: those are what the tool is asked for.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
from array import array

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
sys.dont_write_bytecode = True
sys.path.insert(0, "tools/cycles")
import pictures  # noqa: E402
import scene_model  # noqa: E402

PATIENCE_S = 600
FILE_KEYS = {"bench", "machine", "commit", "build", "runs", "peer", "levers", "rows", "ratios", "agreement"}
ROW_KEYS = {"scene", "renderer", "spp", "bounces", "width", "height", "threads", "reference_spp", "samples_per_cpu_s", "cpu_s",
            "process_cpu_s", "rel_mse", "rel_mse_all", "rel_mse_median", "error_x_time"}
RATIOS = {"samples_per_cpu_s", "rel_mse", "error_x_time"}
CONFIDENCE = 4.5  # Standard errors: a right picture is refused once in 150,000 channels.
MODELLING = 0.005  # What may differ besides noise: the two agree within that on long runs.

CAMERA = {"position": [0.5, 0.5, 2], "look_at": [0.5, 0.5, 0]}
OBJ = """mtllib box.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0.25 0.75
usemtl lamp
f -4/1 -3/1 -2/1 -1/1
usemtl paint
f 1 2 3
"""
BOX = """mtllib box.mtl
usemtl paint
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
v 9 0 9
v 9 1 9
v 9 0 8
vn 1 0 0
f 1 4 3 2
f 5 6 7 8
f 1 2 6 5
f 4 8 7 3
f 1 5 8 4
f 2 3 7 6
f 9//1 10//1 11//1
"""
MTL = "newmtl lamp\nKd 0.5 0.5 0.5\nKe 1 2 3\nnewmtl paint\nmap_Kd -s 1 1 1 wood.png\n"


def compare(*words, **environment):
    return subprocess.run([sys.executable, "tools/compare-cycles", "--bin", BIN, *map(str, words)], capture_output=True, text=True,
                          timeout=PATIENCE_S, env={**os.environ, **environment})


class Folder(unittest.TestCase):
    def setUp(self):
        made = tempfile.TemporaryDirectory(prefix="pathscope_cycles_")
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)

    def write(self, mtl=MTL, **changes):
        """A scene file beside its OBJ and MTL."""
        spec = {"name": "box", "obj": "box.obj", "camera": CAMERA, **changes}
        for name, text in (("box.obj", OBJ), ("box.mtl", mtl), ("scene.json", json.dumps(spec))):
            (self.folder / name).write_text(text)
        return self.folder / "scene.json"


class Pictures(unittest.TestCase):
    def test_error_of_a_picture_that_is_a_tenth_too_bright(self):
        reference = array("f", [2.0] * 3000)
        errors = pictures.errors(array("f", [2.2] * 3000), reference)
        for key in ("rel_mse", "rel_mse_all", "rel_mse_median"):  # 0.2² / (2² + 0.2²)
            self.assertAlmostEqual(errors[key], 0.04 / 4.04, places=6)

    def test_the_largest_error_is_trimmed_and_counted_beside(self):
        picture = array("f", [2.0] * 3000)
        picture[0] = 2.0 + 300.0
        errors = pictures.errors(picture, array("f", [2.0] * 3000))
        self.assertEqual((errors["rel_mse"], errors["rel_mse_median"]), (0, 0))
        self.assertAlmostEqual(errors["rel_mse_all"], 300.0 ** 2 / 4.04 / 3000, places=3)

    def test_agreement(self):
        ours, theirs = array("f", [1.0, 2.0, 3.3] * 256), array("f", [1.0, 2.0, 3.0] * 256)
        told = pictures.agreement((16, 16), ours, theirs, [[0.0, 0.0, 0.09], [0.0, 0.0, 0.0]])
        for value, expected in zip(told["mean_ratio"] + told["mean_ratio_error"], (1, 1, 1.1, 0, 0, 0.1)):
            self.assertAlmostEqual(value, expected, places=6)
        self.assertAlmostEqual(told["block_difference_p95"], 0.3 / 3.02, places=5)
        self.assertEqual(told["block_difference_median"], 0)


class Reader(Folder):
    def test_faces_emission_and_uvs(self):
        scene = scene_model.read_scene(self.write(mtl=MTL.replace("-s 1 1 1 ", ""), lights=[{"type": "emissive_mtl", "two_sided": False}]))
        lamp, paint = scene.materials
        self.assertEqual((lamp.ke, lamp.kd, lamp.two_sided), ((1, 2, 3), (0, 0, 0), False))
        self.assertEqual((paint.kd, paint.map_kd), ((1, 1, 1), self.folder / "wood.png"))
        self.assertEqual((list(scene.mesh.corners), scene.mesh.first_corner), ([0, 1, 2, 3, 0, 1, 2], [0, 4, 7]))
        self.assertEqual(list(scene.mesh.uvs), [0.25, 0.75] * 4 + [0, 0] * 3)

    def test_ke_is_dark_where_the_scene_names_other_lights(self):
        scene = scene_model.read_scene(self.write(mtl=MTL.replace("-s 1 1 1 ", ""), lights=[{"type": "sky", "radiance": [1, 1, 1]}]))
        self.assertEqual((scene.materials[0].ke, scene.materials[0].kd), ((0, 0, 0), (0.5, 0.5, 0.5)))

    def test_refused(self):
        with self.assertRaisesRegex(scene_model.Refused, "box.mtl:5: maps with options"):
            scene_model.read_scene(self.write())
        with self.assertRaisesRegex(scene_model.Refused, "map_ke"):
            scene_model.read_scene(self.write(mtl="newmtl lamp\n", materials={"lamp": {"map_ke": "a.png"}}))


class Refusals(Folder):
    def refused(self, done, *named):
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        for word in named:
            self.assertIn(word, done.stderr)

    def test_without_blender(self):
        self.refused(compare("--scene", "scenes/cornell/scene.json", PATH=str(self.folder)), "install the Debian package blender")

    def test_a_light_that_is_not_compared(self):
        scene = self.write(lights=[{"type": "point", "position": [0, 0, 0], "intensity": [1, 1, 1]}])
        self.refused(compare("--scene", scene), "scene.json", "point")

    def test_options(self):
        scene = ("--scene", "scenes/cornell/scene.json")
        for words, named in (((), "--scene"), (("--scene", "nowhere.json"), "nowhere.json"), ((*scene, "--size", "32"), "--size"),
                             ((*scene, "--spp", 1), "--spp"), ((*scene, "--lever", "seed=3"), "--lever"), ((*scene, "--bounces", 0), "--bounces"),
                             ((*scene, "--spp", 4, "--spp", 8), "--spp"), ((*scene, "--json", "no/where.json"), "no/where.json")):
            with self.subTest(words):
                self.refused(compare(*words), named)


@unittest.skipUnless(shutil.which("blender"), "skipped: no blender; the Debian package blender has Cycles")
class Comparison(Folder):
    def test_cornell(self):
        """Two bounces, so that one more or less of either renderer would be far off."""
        path = self.folder / "cycles.json"
        done = compare("--scene", "scenes/cornell/scene.json", "--size", "32x32", "--spp", 64, "--reference-spp", 256, "--bounces", 2,
                       "--runs", 1, "--json", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        file = json.loads(path.read_text())
        self.assertEqual(set(file), FILE_KEYS)
        self.assertEqual((file["bench"], file["runs"]), ("cycles", 1))
        self.assertEqual([row["renderer"] for row in file["rows"]], ["pathscope", "cycles"])
        for row in file["rows"]:
            self.assertEqual(set(row), ROW_KEYS)
            self.assertEqual((row["scene"], row["width"], row["height"], row["spp"], row["bounces"]), ("cornell", 32, 32, 64, 2))
            self.assertTrue(row["samples_per_cpu_s"] > 0 and 0 < row["cpu_s"] and 0 < row["rel_mse"] <= row["rel_mse_all"], row)
        self.assertLessEqual(RATIOS, set(file["ratios"][0]))
        self.check_means(file["agreement"][0])

    def test_faces_without_normals_beside_faces_with(self):
        """An OBJ may give normals to some faces only; the others are flat. Here that is a box: with normals made up by the
        importer, its sides would be lit from where nothing shines."""
        self.write(mtl="newmtl paint\nKd 0.7 0.7 0.7\n", lights=[{"type": "sun", "to_sun": [0, 1, 0], "irradiance": [3, 3, 3]}],
                   camera={"position": [2, 1.5, 2.5], "look_at": [0.5, 0.5, 0.5]})
        (self.folder / "box.obj").write_text(BOX)
        path = self.folder / "cycles.json"
        done = compare("--scene", self.folder / "scene.json", "--size", "32x32", "--spp", 64, "--reference-spp", 256, "--bounces", 1,
                       "--runs", 1, "--json", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        for ratio in json.loads(path.read_text())["agreement"][0]["mean_ratio"]:
            self.assertLess(abs(ratio - 1), 0.02)

    def test_a_black_picture_is_refused(self):
        """One bounce from a lamp that shines away from the camera, in front of nothing."""
        scene = self.write(mtl="newmtl lamp\nKe 1 1 1\nnewmtl paint\n", lights=[{"type": "emissive_mtl", "two_sided": False}],
                           camera={"position": [0.5, 0.5, -2], "look_at": [0.5, 0.5, 0]})
        done = compare("--scene", scene, "--size", "8x8", "--spp", 2, "--runs", 1, "--reference-spp", 4)
        self.assertEqual((done.returncode, "black" in done.stderr.splitlines()[-1]), (2, True), done.stderr)

    def check_means(self, alike):
        for ratio, error in zip(alike["mean_ratio"], alike["mean_ratio_error"]):
            self.assertTrue(0 < error < 0.02, alike)
            self.assertLess(abs(ratio - 1), CONFIDENCE * error + MODELLING, alike)


if __name__ == "__main__":
    unittest.main(verbosity=2)
