#!/usr/bin/env python3
"""The mesh cache through the programs: the image is the same without it, while it fills, from it, and when its files are damaged.

    test_mesh_cache.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
PATIENCE_S = 300
SIDE = 80  # Quads along a side: enough for an OBJ that is worth a file.


def bumpy_plane():
    lines = ["s 1"]
    for y in range(SIDE + 1):
        lines += [f"v {x / SIDE:.6f} {((3 * x + 5 * y) % 7) / 90:.6f} {y / SIDE:.6f} # {'padding ' * 4}" for x in range(SIDE + 1)]
    for y in range(SIDE):
        for x in range(SIDE):
            corner = y * (SIDE + 1) + x + 1
            lines.append(f"f {corner} {corner + SIDE + 1} {corner + SIDE + 2} {corner + 1}")
    return "\n".join(lines) + "\n"


class MeshCacheOfPrograms(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pathscope_mesh_cache_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "plane.obj").write_text(bumpy_plane())
        self.assertGreater((self.folder / "plane.obj").stat().st_size, 256 * 1024)

    def render(self, *arguments):
        """The hash of the image, and what was said."""
        stats = self.folder / "stats.json"
        words = [BIN / "pathscope-render", "plane.obj", "-o", "a.pfm", "--size", "32x32", "--spp", "2", "--stats", stats, *arguments]
        environment = dict(os.environ, XDG_CACHE_HOME=str(self.folder / "cache"))
        done = subprocess.run(words, capture_output=True, text=True, cwd=self.folder, env=environment, timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(stats.read_text())["image_hash"], done.stderr

    def meshes(self, folder):
        return sorted(folder.iterdir()) if folder.exists() else []

    def test_the_image_does_not_depend_on_the_cache(self):
        default = self.folder / "cache" / "pathscope" / "meshes"
        image, _ = self.render("--mesh-cache", "off")
        self.assertEqual(self.meshes(default), [])
        self.assertEqual(self.render()[0], image)
        [mesh] = self.meshes(default)
        self.assertEqual(self.render()[0], image)
        good = mesh.read_bytes()
        for place in range(0, len(good), len(good) // 8):
            with self.subTest(place=place):
                mesh.write_bytes(good[:place] + bytes([good[place] ^ 64]) + good[place + 1 :])
                hash_of_image, said = self.render()
                self.assertEqual(hash_of_image, image)
                self.assertEqual(said.count(str(mesh)), 1, said)
                self.assertEqual(mesh.read_bytes(), good)

    def test_local_servers_share_the_cache_of_the_client(self):
        folder = self.folder / "elsewhere"
        image, _ = self.render("--mesh-cache", "off", "--servers", "1")
        self.assertEqual(self.meshes(self.folder / "cache" / "pathscope" / "meshes"), [])
        self.assertEqual(self.render("--mesh-cache", str(folder), "--servers", "1")[0], image)
        self.assertEqual(self.meshes(self.folder / "cache" / "pathscope" / "meshes"), [])
        self.assertEqual(len(self.meshes(folder)), 1)

    def test_a_folder_without_a_name_is_refused(self):
        done = subprocess.run([BIN / "pathscope-render", "plane.obj", "-o", "a.pfm", "--mesh-cache", ""], capture_output=True,
                              text=True, cwd=self.folder, timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--mesh-cache", done.stderr)


if __name__ == "__main__":
    unittest.main()
