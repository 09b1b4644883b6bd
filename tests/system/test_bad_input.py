"""Bad input: each case ends with exit code 2 and one sentence that names what and where, or with a picture and a warning.
Never with a crash; run on the sanitizer builds as well.

    test_bad_input.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
PATIENCE_S = 300

QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
BOX = QUAD + "usemtl m\nf 1 2 3 4\n"
MTL = "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n"
CAMERA = {"position": [0.5, 0.5, 2], "look_at": [0.5, 0.5, 0]}


def scene(**changes):
    return json.dumps({"name": "s", "obj": "box.obj", "camera": CAMERA, "lights": [{"type": "sky", "radiance": [1, 1, 1]}],
                       **changes})


def light(**keys):
    return scene(lights=[keys])


def obj(text):
    return {"box.obj": text, "s.json": scene()}


# name, files of the folder, arguments, what the sentence must name. SCENE stands for s.json, OUT for a picture.
REFUSED = [
    ("no scene file", {}, "none.json -o OUT", "none.json"),
    ("a folder for a scene", {}, ". -o OUT", "scene file"),
    ("an empty scene", {"s.json": ""}, "SCENE -o OUT", "s.json"),
    ("an empty OBJ", {"box.obj": "", "s.json": scene()}, "SCENE -o OUT", "box.obj"),
    ("JSON cut off", {"s.json": scene()[:40]}, "SCENE -o OUT", "s.json"),
    ("JSON that is a list", {"s.json": "[]"}, "SCENE -o OUT", "s.json"),
    ("an unknown key", {"s.json": scene(colour=1)}, "SCENE -o OUT", "colour"),
    ("an unknown key in a light", {"s.json": light(type="sky", radiance=[1, 1, 1], color=1)}, "SCENE -o OUT", "lights[0].color"),
    ("an unknown light", {"s.json": light(type="torch")}, "SCENE -o OUT", "torch"),
    ("a wrong type", {"s.json": scene(name=7)}, "SCENE -o OUT", "name"),
    ("a colour of two numbers", {"s.json": light(type="sky", radiance=[1, 1])}, "SCENE -o OUT", "radiance"),
    ("a negative radiance", {"s.json": light(type="sky", radiance=[1, -1, 1])}, "SCENE -o OUT", "radiance"),
    ("a negative size", {"s.json": scene(defaults={"size": [-4, 4]})}, "SCENE -o OUT", "size"),
    ("a camera that looks at itself", {"s.json": scene(camera={"position": [0, 0, 0], "look_at": [0, 0, 0]})}, "SCENE -o OUT", "camera"),
    ("an angle of 200 degrees", {"s.json": scene(camera={**CAMERA, "vfov_deg": 200})}, "SCENE -o OUT", "vfov"),
    ("a missing OBJ", {"s.json": scene(obj="gone.obj")}, "SCENE -o OUT", "gone.obj"),
    ("a face index out of range", obj(QUAD + "f 1 2 9\n"), "SCENE -o OUT", "box.obj:5"),
    ("a face index of zero", obj(QUAD + "f 0 1 2\n"), "SCENE -o OUT", "box.obj:5"),
    ("a negative index out of range", obj(QUAD + "f -1 -2 -9\n"), "SCENE -o OUT", "box.obj:5"),
    ("a NaN vertex", obj("v 0 0 nan\n" + BOX), "SCENE -o OUT", "box.obj:1"),
    ("an infinite vertex", obj("v 0 inf 0\n" + BOX), "SCENE -o OUT", "box.obj:1"),
    ("a vertex of two numbers", obj("v 0 0\n" + BOX), "SCENE -o OUT", "box.obj:1"),
    ("a face of words", obj(QUAD + "f a b c\n"), "SCENE -o OUT", "box.obj:5"),
    ("an override of no material", {"box.obj": BOX, "s.json": scene(materials={"none": {"kd": [1, 1, 1]}})}, "SCENE -o OUT", "none"),
    ("a sun below all numbers", {"s.json": light(type="sun", to_sun=[0, 0, 0], irradiance=[1, 1, 1])}, "SCENE -o OUT", "to_sun"),
    ("a missing environment map", {"box.obj": BOX, "s.json": light(type="envmap", file="none.hdr")}, "SCENE -o OUT", "none.hdr"),
    ("an environment map of noise", {"box.obj": BOX, "e.hdr": "noise", "s.json": light(type="envmap", file="e.hdr")}, "SCENE -o OUT", "e.hdr"),
    ("an unknown camera", obj(BOX), "SCENE -o OUT --camera side", "side"),
    ("an unknown flag", obj(BOX), "SCENE -o OUT --fast", "--fast"),
    ("a size that is no size", obj(BOX), "SCENE -o OUT --size 640", "640"),
    ("a size of zero", obj(BOX), "SCENE -o OUT --size 0x10", "0x10"),
    ("a size beyond the limit", obj(BOX), "SCENE -o OUT --size 100000x1", "100000x1"),
    ("no samples", obj(BOX), "SCENE -o OUT --spp 0", "--spp"),
    ("samples that are no number", obj(BOX), "SCENE -o OUT --spp many", "--spp"),
    ("a target error of zero", obj(BOX), "SCENE -o OUT --target-error 0", "--target-error"),
    ("adaptive rounds neither on nor off", obj(BOX), "SCENE -o OUT --adaptive yes", "--adaptive"),
    ("too few samples for adaptive rounds", obj(BOX), "SCENE -o OUT --adaptive on --spp 5", "--spp 5"),
    ("too many samples for adaptive rounds", obj(BOX), "SCENE -o OUT --target-error 1 --spp 300000", "--spp 300000"),
    ("adaptive rounds of filtered tiles", obj(BOX), "SCENE -o OUT --adaptive on --filter server", "--filter server"),
    ("an unknown lever", obj(BOX), "SCENE -o OUT --roulette russian", "--roulette"),
    ("an unknown setting", obj(BOX), "SCENE -o OUT --setting worst", "--setting"),
    ("direct only and indirect only", obj(BOX), "SCENE -o OUT --direct-only --indirect-only", "--indirect-only"),
    ("a negative number of servers", obj(BOX), "SCENE -o OUT --servers -1", "--servers"),
    ("two ports", obj(BOX), "SCENE -o OUT --ports 1,2", "--ports"),
    ("a block of nothing", obj(BOX), "SCENE -o OUT --block 0", "--block"),
    ("an unknown buffer", obj(BOX), "SCENE -o OUT --buffers beauty", "beauty"),
    ("no output", obj(BOX), "SCENE", "--output"),
    ("an output of no known kind", obj(BOX), "SCENE -o x.gif", "x.gif"),
    ("an output in no folder", obj(BOX), "SCENE -o no/where/x.png", "no/where"),
    ("statistics in no folder", obj(BOX), "SCENE -o OUT --stats no/where/x.json", "no/where"),
    ("an open address without keys", obj(BOX), "SCENE -o OUT --listen 0.0.0.0", "--insecure"),
    ("an address of nobody here", obj(BOX), "SCENE -o OUT --listen 127.0.0.300", "127.0.0.300"),
]

# Odd, but a picture comes of it; the warning or note must name the thing.
WARNED = [
    ("a zero-area triangle", obj(BOX + "f 1 1 2\n"), "SCENE -o OUT", "box.obj"),
    ("a missing texture", {"box.obj": "mtllib m.mtl\n" + BOX, "m.mtl": MTL + "map_Kd none.png\n", "s.json": scene()}, "SCENE -o OUT", "none.png"),
    ("a texture of noise", {"box.obj": "mtllib m.mtl\n" + BOX, "m.mtl": MTL + "map_Kd t.png\n", "t.png": "noise", "s.json": scene()}, "SCENE -o OUT", "t.png"),
    ("a missing MTL", obj("mtllib gone.mtl\n" + BOX), "SCENE -o OUT", "gone.mtl"),
    ("a bare OBJ without a light", {"box.obj": BOX}, "box.obj -o OUT", "sky"),
    ("a light of no power", {"box.obj": BOX, "s.json": light(type="sky", radiance=[0, 0, 0])}, "SCENE -o OUT", "black"),
    ("default ports in use", obj(BOX), "SCENE -o OUT --servers 1 PORTS-IN-USE", "in use"),
]


class BadInput(unittest.TestCase):
    def run_case(self, files, arguments):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                (pathlib.Path(folder) / name).write_text(text)
            busy = None
            if "PORTS-IN-USE" in arguments:
                arguments = arguments.replace("PORTS-IN-USE", "")
                busy = socket.socket()
                try:
                    busy.bind(("127.0.0.1", 5556))
                    busy.listen()
                except OSError:
                    pass  # Somebody else holds it: just as well.
            words = arguments.replace("SCENE", "s.json").replace("OUT", "out.pfm").split()
            if "--size" not in words:
                words += ["--size", "8x8"]
            if "--spp" not in words:
                words += ["--spp", "1"]
            environment = dict(os.environ, XDG_CACHE_HOME=folder)
            done = subprocess.run([BIN / "pathscope-render", *words], cwd=folder, env=environment, capture_output=True,
                                  text=True, timeout=PATIENCE_S)
            if busy:
                busy.close()
            return done, (pathlib.Path(folder) / "out.pfm").exists()

    def test_refused(self):
        for name, files, arguments, named in REFUSED:
            with self.subTest(name):
                done, written = self.run_case(files, arguments)
                self.assertEqual(done.returncode, 2, done.stderr)
                last = done.stderr.strip().splitlines()[-1]
                self.assertTrue(last.startswith("pathscope-render: "), done.stderr)
                self.assertIn(named, last)
                self.assertFalse(written)

    def test_warned(self):
        for name, files, arguments, named in WARNED:
            with self.subTest(name):
                done, written = self.run_case(files, arguments)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertIn(named, done.stderr)
                self.assertTrue(written)

    def test_a_bare_obj_says_what_was_chosen(self):
        done, _ = self.run_case({"box.obj": BOX}, "box.obj -o OUT")
        self.assertIn("camera", done.stderr)
        self.assertIn("sky", done.stderr)

    def test_an_unwritable_output(self):
        if os.geteuid() == 0:
            self.skipTest("root may write everywhere")
        done, _ = self.run_case({"box.obj": BOX}, "box.obj -o /x.png")
        self.assertEqual(done.returncode, 2)

    def test_server_arguments(self):
        for words, named in (["--threads", "many"], "--threads"), (["--ports", "1,2,99999"], "--ports"), (["--name", ""], "--name"), (["x"], "x"):
            with self.subTest(words):
                done = subprocess.run([BIN / "pathscope-server", *words], capture_output=True, text=True, timeout=PATIENCE_S)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(named, done.stderr)


if __name__ == "__main__":
    unittest.main()
