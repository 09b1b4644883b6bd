#!/usr/bin/env python3
"""Light that loses bits on its way: how much is lost, how many bytes are saved, and that nobody takes the image for the exact one.

    test_wire_formats.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, "tools/cycles")
from pictures import read_pfm  # noqa: E402

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
PATIENCE_S = 300
WIDTH, HEIGHT, SPP = 70, 50, 8


class WireFormats(unittest.TestCase):
    def render(self, wire, *arguments, spp=SPP):
        with tempfile.TemporaryDirectory(prefix="pathscope_wire_") as folder:
            folder = pathlib.Path(folder)
            words = [BIN / "pathscope-render", "scenes/cornell/scene.json", "-o", folder / "a.pfm", "--size", f"{WIDTH}x{HEIGHT}",
                     "--spp", str(spp), "--indirect-only", "--servers", "1", "--wire", wire, "--stats", folder / "stats.json", *arguments]
            done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)
            self.assertEqual(done.returncode, 0, done.stderr)
            return json.loads((folder / "stats.json").read_text()), read_pfm(folder / "a.pfm")[2], done.stderr

    def test_each_format_is_as_near_as_it_says_and_as_small(self):
        exact, truth, said = self.render("exact")
        self.assertEqual((exact["wire"], exact["reproducible"]), ("exact", True))
        self.assertNotIn("reproducible", said)
        self.assertEqual(exact["tile_bytes_unpacked"], 24 * WIDTH * HEIGHT * exact["rounds"] // 6)  # Six blocks.
        for wire, bound, per_pixel in (("half", 2**-11, 6), ("shared", 2**-9, 4)):
            with self.subTest(wire=wire):
                stats, picture, said = self.render(wire)
                self.assertEqual((stats["wire"], stats["reproducible"]), (wire, False))
                self.assertIn("not reproducible", said)
                self.assertNotEqual(stats["image_hash"], exact["image_hash"])
                self.assertEqual(stats["samples"], exact["samples"])
                rounds = stats["rounds"] // 6
                self.assertEqual(stats["tile_bytes_unpacked"], per_pixel * WIDTH * HEIGHT * rounds + stats["rounds"])
                self.assertLess(stats["tile_bytes"], exact["tile_bytes"] * 2 / 3)
                # The mean of sums of which each is within the bound; a float's own rounding beside it.
                for pixel in range(0, len(truth), 3):
                    largest = max(truth[pixel : pixel + 3])
                    for channel in range(3):
                        error = abs(picture[pixel + channel] - truth[pixel + channel])
                        scale = truth[pixel + channel] if wire == "half" else largest
                        # Rounds of one pixel differ in which channel is the largest: their bounds add up to at most three times.
                        allowed = bound * scale * (1 if wire == "half" else 3) + 2**-22 * largest
                        self.assertLessEqual(error, allowed, (pixel // 3, channel))

    def test_adaptive_rounds_work_with_them(self):
        stats, _, _ = self.render("half", "--adaptive", "on", spp=16)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        self.assertEqual(stats["bad_messages"], 0)


if __name__ == "__main__":
    unittest.main()
