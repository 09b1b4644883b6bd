"""Each defect of the classic system, S1 to S13, has a test that carries its number, in every file that docs/testing.md names for it.

    test_defects.py
"""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
ROW = re.compile(r"^\| (S\d+) \|.*\| ([^|]+) \|$", re.MULTILINE)


def has_test(text, number):
    """As a test case of doctest, whose name begins with it, or as a method of a unittest, whose name ends with it."""
    return re.search(rf'TEST_CASE\(\s*"{number}: ', text) or re.search(rf"def test_\w+_{number}\(", text)


class Defects(unittest.TestCase):
    def test_each_has_its_tests(self):
        rows = dict(ROW.findall((ROOT / "docs/testing.md").read_text()))
        self.assertEqual(list(rows), [f"S{n}" for n in range(1, 14)])
        for number, links in rows.items():
            files = re.findall(r"\]\(\.\./([^)]+)\)", links)
            self.assertTrue(files, number)
            for file in files:
                with self.subTest(defect=number, file=file):
                    self.assertTrue(has_test((ROOT / file).read_text(), number))

    def test_the_numbers_are_told_apart(self):
        self.assertFalse(has_test('TEST_CASE("S13: alone")', "S1"))
        self.assertTrue(has_test('TEST_CASE(\n    "S1: together")', "S1"))


if __name__ == "__main__":
    unittest.main()
