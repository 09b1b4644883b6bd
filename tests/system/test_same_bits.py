"""The image does not depend on what finds the hits or how many lanes it has: every instruction set, both trees, any number
of threads, with and without a server, and the filter with them.

    test_same_bits.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import itertools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
LEVELS = ["portable", "avx2", "avx512"]  # One that the machine lacks becomes the best that it has.
SCENES = ["scenes/cornell/scene.json", "scenes/mis_plates/scene.json"]


class SameBits(unittest.TestCase):
    def test_filter_kinds(self):
        with tempfile.TemporaryDirectory() as folder:
            joint = self.hash_of(folder, SCENES[0], "avx2")
            kinds = {(level, *how): self.hash_of(folder, SCENES[0], level, "--filter-kind", "atrous", "--filter-levels", "4", *how)
                     for level, how in itertools.product(LEVELS, [["--threads", "1"], ["--servers", "1"]])}
            self.assertEqual(len(set(kinds.values())), 1, kinds)
            self.assertNotIn(joint, kinds.values())
            at_server = [self.hash_of(folder, SCENES[0], "avx2", "--filter", "server", "--filter-kind", "atrous", *how)
                         for how in (["--servers", "0"], ["--servers", "2"])]
            self.assertEqual(at_server[0], at_server[1])

    def hash_of(self, folder, scene, level, *options):
        place = [] if "--filter" in options else ["--filter", "client"]
        stats = pathlib.Path(folder) / "stats.json"
        subprocess.run([BIN / "pathscope-render", scene, "-o", pathlib.Path(folder) / "image.pfm", "--stats", stats, "--size",
                        "75x50", "--spp", "6", "--seed", "3", *place, *options], check=True,
                       stderr=subprocess.DEVNULL, env=dict(os.environ, PATHSCOPE_SIMD=level))
        return json.loads(stats.read_text())["image_hash"]

    def test_golden_round(self):
        """What a server says of its bits does not depend on the instructions that this machine has."""
        hashes = set()
        for level in LEVELS:
            run = subprocess.run([BIN.parent / "test_render", "-tc=the golden round is the same*"], check=True, capture_output=True,
                                 text=True, env=dict(os.environ, PATHSCOPE_SIMD=level))
            hashes.update(re.findall("golden hash: ([0-9a-f]{64})", run.stdout))
        self.assertEqual(len(hashes), 1, hashes)

    def test_levels_trees_threads_servers(self):
        choices = list(itertools.product(LEVELS, ["wide", "two-wide"], [["--threads", "1"], ["--threads", "2"], ["--servers", "1"]]))
        with tempfile.TemporaryDirectory() as folder:
            for scene in SCENES:
                hashes = {(level, tree, *how): self.hash_of(folder, scene, level, "--bvh", tree, *how)
                          for level, tree, how in choices}
                self.assertEqual(len(set(hashes.values())), 1, hashes)


if __name__ == "__main__":
    unittest.main(verbosity=2)
