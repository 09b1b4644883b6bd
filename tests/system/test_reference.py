"""The scenes in ../shared against an independent renderer's images of them, by the measure that its README states: means
over blocks of 8x8 pixels, median within 2 %, 95th percentile within 8 %, image means within 1 %.

    test_reference.py BIN      BIN: the folder of pathscope-render
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SHARED = pathlib.Path("../shared")
SAMPLES = "128"


@unittest.skipUnless(SHARED.is_dir(), "skipped: no ../shared")
class Reference(unittest.TestCase):
    def compare(self, name, size, *more):
        """Median and 95th percentile of the relative error in per cent, ratio of means, and the verdict."""
        with tempfile.TemporaryDirectory() as folder:
            image = pathlib.Path(folder) / "image.pfm"
            subprocess.run([BIN / "pathscope-render", SHARED / "scenes" / name / "scene.json", "-o", image, "--size", size,
                            "--spp", SAMPLES, "--seed", "1", "--material", "lambert", "--smoothing", "off", *more], check=True,
                           stderr=subprocess.DEVNULL)
            text = subprocess.run([sys.executable, SHARED / "reference" / "compare.py",
                                   SHARED / "reference" / f"{name}.pfm", image], capture_output=True, text=True).stdout
        print(name, text.strip(), file=sys.stderr)
        return text.split()[0], [float(number) for number in re.findall(r"[\d.]+", text)]

    def check(self, name, size, *more):
        self.assertEqual(self.compare(name, size, *more)[0], "close")

    def test_mitsuba_cornell(self):
        self.check("mitsuba_cornell", "400x400")

    def test_cornell_box(self):
        self.check("cornell_box", "256x256")

    def test_conference(self):
        self.check("conference", "320x180")

    def test_dabrovic_sponza(self):
        self.check("dabrovic_sponza", "320x180")

    def test_crytek_sponza(self):
        # Its reference interpolates textures as sRGB codes: docs/conventions.md, "Where other renderers differ".
        self.check("crytek_sponza", "320x180", "--texel-space", "srgb")


if __name__ == "__main__":
    unittest.main(verbosity=2)
