#!/usr/bin/env python3
"""The test of the scenes that come with Pathscope: every file they name is there, every index and material exists, given
normals are of length one and agree with the winding, coordinates are finite; and make-atrium writes the same bytes twice.

usage: test_scenes.py PATH_OF_MAKE_ATRIUM
"""
import json
import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent.parent
MAKE_ATRIUM = None  # from the command line


def read_materials(path):
    """Names of an MTL's materials and the files of its maps."""
    names, maps = set(), set()
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["newmtl"]:
            names.add(words[1])
        elif words and words[0].startswith("map_"):
            maps.add(words[-1])
    return names, maps


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def problems_of_obj(path):
    """Sentences about what is wrong with an OBJ file, and the number of its faces."""
    found, faces, defined, used = [], 0, set(), None
    positions, normals, uvs = [], [], []
    lists = (positions, uvs, normals)  # in the order of a face's v/vt/vn
    for number, line in enumerate(path.read_text().splitlines(), 1):
        kind, *words = line.split() or [""]
        if kind in ("v", "vn", "vt"):
            values = tuple(float(word) for word in words)
            if not all(math.isfinite(value) for value in values):
                found.append(f"{path.name}:{number}: not finite")
            {"v": positions, "vn": normals, "vt": uvs}[kind].append(values)
            if kind == "vn" and abs(dot(values, values) - 1) > 1e-3:
                found.append(f"{path.name}:{number}: a normal of length {math.sqrt(dot(values, values))}")
        elif kind == "mtllib":
            names, maps = read_materials(path.parent / words[0])
            defined |= names
            found += [f"{words[0]}: no file {name}" for name in maps if not (path.parent / name).is_file()]
        elif kind == "usemtl":
            used = words[0]
            if used not in defined:
                found.append(f"{path.name}:{number}: no material {used}")
        elif kind == "f":
            faces += 1
            corners = [[int(index) for index in word.split("/")] for word in words]
            if any(not 1 <= index <= len(lists[i]) for corner in corners for i, index in enumerate(corner)):
                found.append(f"{path.name}:{number}: an index that does not exist")
                continue
            a, b, c = (positions[corner[0] - 1] for corner in corners[:3])
            by_winding = cross(subtract(b, a), subtract(c, a))
            if dot(by_winding, by_winding) == 0:
                found.append(f"{path.name}:{number}: a face without area")
            if len(corners[0]) == 3 and any(dot(by_winding, normals[corner[2] - 1]) <= 0 for corner in corners):
                found.append(f"{path.name}:{number}: normal and winding disagree")
    return found, faces


class Scenes(unittest.TestCase):
    def check(self, scene_file, folder):
        scene = json.loads(scene_file.read_text())
        objs = scene["obj"] if isinstance(scene["obj"], list) else [scene["obj"]]
        count = 0
        for obj in objs:
            found, faces = problems_of_obj(folder / Path(obj).name)
            self.assertEqual(found[:5], [], scene_file)
            count += faces
        return count

    def test_small_scenes(self):
        files = [path for path in sorted(PROJECT.glob("scenes/*/*.json")) if path.parent.name != "atrium"]
        self.assertGreaterEqual(len(files), 4)
        for path in files:
            with self.subTest(scene=path):
                self.assertGreater(self.check(path, path.parent), 0)

    def test_atrium_is_whole_and_the_same_in_every_run(self):
        with tempfile.TemporaryDirectory(prefix="pathscope_atrium_") as folder:
            runs = [Path(folder) / "one", Path(folder) / "two"]
            for run in runs:
                subprocess.run([MAKE_ATRIUM, "--out", run], check=True, capture_output=True)
            names = sorted(path.name for path in runs[0].iterdir())
            self.assertEqual(names, sorted(path.name for path in runs[1].iterdir()))
            for name in names:
                self.assertEqual((runs[0] / name).read_bytes(), (runs[1] / name).read_bytes(), name)
            triangles = self.check(PROJECT / "scenes/atrium/scene.json", runs[0])
            self.assertTrue(200_000 <= triangles <= 350_000, triangles)

    def test_a_folder_that_cannot_be_made(self):
        with tempfile.NamedTemporaryFile() as file:
            result = subprocess.run([MAKE_ATRIUM, "--out", file.name + "/below"], capture_output=True, text=True)
            self.assertEqual(result.returncode, 2)
            self.assertIn(file.name, result.stderr)

    def test_an_unknown_flag(self):
        self.assertEqual(subprocess.run([MAKE_ATRIUM, "--nothing"], capture_output=True).returncode, 2)


if __name__ == "__main__":
    MAKE_ATRIUM = sys.argv.pop(1)
    unittest.main()
