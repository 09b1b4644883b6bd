#!/usr/bin/env python3
"""The test of docs/programs.md: its tables list the flags that --help lists, and the keys that --stats writes, no more and no fewer.

usage: test_programs.py FOLDER_OF_PROGRAMS
"""
import json
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent.parent
DOCUMENT = (PROJECT / "docs" / "programs.md").read_text(encoding="utf-8")
PROGRAMS = None  # from the command line
REQUIRED = {"pathscope-render": ["scene.json", "-o", "image.png"], "pathscope-bench": ["bvh"],
            "pathscope-chaos": ["--listen", "127.0.0.1:0", "--connect", "127.0.0.1:1"]}


def run(program, *arguments):
    return subprocess.run([PROGRAMS / program, *arguments], capture_output=True, text=True, cwd=PROJECT)


def section(title):
    """The text under a heading, up to the next one of any level."""
    match = re.search(rf"^#+ {re.escape(title)}\n(.*?)(?=^#|\Z)", DOCUMENT, re.MULTILINE | re.DOTALL)
    return match.group(1)


def first_cells(text):
    """Of each table row: what stands in backquotes in its first cell."""
    cells = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    return {word for cell in cells for word in re.findall(r"`([^`]+)`", cell)}


class Programs(unittest.TestCase):
    def test_flags(self):
        titles = re.findall(r"^## (\S+)$", DOCUMENT, re.MULTILINE)
        self.assertEqual(sorted(titles), sorted(path.name for path in PROGRAMS.iterdir()))
        for program in titles:
            with self.subTest(program=program):
                listed = set(re.findall(r"--[a-z][a-z-]*", run(program, "--help").stdout)) - {"--help", "--version"}
                documented = {cell.split()[0] for cell in first_cells(section(program)) if cell.startswith("--")}
                self.assertEqual(documented, listed)

    def test_help_version_and_bad_usage(self):
        for path in PROGRAMS.iterdir():
            with self.subTest(program=path.name):
                self.assertEqual(run(path.name, "--help").returncode, 0)
                self.assertRegex(run(path.name, "--version").stdout, rf"^{path.name} \d+\.\d+\.\d+\n$")
                bad = run(path.name, *REQUIRED.get(path.name, []), "--no-such-flag")
                self.assertEqual(bad.returncode, 2)
                self.assertIn("--no-such-flag", bad.stderr)

    def test_keys_of_the_statistics(self):
        with tempfile.TemporaryDirectory(prefix="pathscope_stats_") as folder:
            stats = Path(folder) / "stats.json"
            result = run("pathscope-render", "scenes/furnace/scene.json", "-o", f"{folder}/a.pfm", "--size", "8x8", "--spp",
                         "1", "--stats", stats)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(first_cells(section("What --stats writes")), set(json.loads(stats.read_text())))

    def test_keys_of_the_relays_statistics(self):
        with tempfile.TemporaryDirectory(prefix="pathscope_stats_") as folder:
            stats = Path(folder) / "stats.json"
            relay = subprocess.Popen([PROGRAMS / "pathscope-chaos", *REQUIRED["pathscope-chaos"], "--stats", stats],
                                     stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
            relay.stdout.readline()
            relay.terminate()
            relay.communicate()
            written = json.loads(stats.read_text())
            keys = {*written, *written["links"][0], *written["links"][0]["up"]}
            self.assertEqual(first_cells(section("What pathscope-chaos --stats writes")), keys)


if __name__ == "__main__":
    PROGRAMS = Path(sys.argv.pop(1)).resolve()
    unittest.main()
