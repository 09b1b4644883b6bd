#!/usr/bin/env python3
"""The test of tools/check-house: a small tree that keeps every rule, and one edit for each way to break one.

Each case names the exact place that the check must report, so a rule that sleeps, or fires elsewhere, fails here.
"""
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent.parent
CHECK = PROJECT / "tools" / "check-house"

GOOD_TREE = {
    "CMakeLists.txt": "# Modules in floor order.\n"
                      "pathscope_module(core                LIBRARIES fmt::fmt)\n"
                      "pathscope_module(math     USES core)\n"
                      "pathscope_module(net      USES core  LIBRARIES zmq)\n"
                      "pathscope_module(bvh      USES core math)\n",
    "docs/architecture.md": "| floor | module | may include | what |\n"
                            "|---|---|---|---|\n"
                            "| 0 | `core` | std | errors |\n"
                            "| 1 | `math` | core | vectors |\n"
                            "| 1 | `net` | core | sockets |\n"
                            "| 2 | `bvh` | core math | trees |\n"
                            "\nSee [the code](../src/bvh/bvh.cpp).\n",
    "include/pathscope/core/check.hpp": "#pragma once\n",
    "include/pathscope/math/vec.hpp": '#pragma once\n#include "pathscope/core/check.hpp"\n',
    "include/pathscope/bvh/bvh.hpp": '#pragma once\n/// Test: tests/bvh/test_bvh.cpp\n#include "pathscope/math/vec.hpp"\n',
    "src/core/parallel_for.cpp": "#include <omp.h>\n#pragma omp parallel\n",
    "src/math/tables.hpp": "#pragma once\n",
    "src/net/socket.cpp": "#include <zmq.hpp>\n",
    "src/bvh/build.hpp": "#pragma once\n",
    "src/bvh/bvh.cpp": '#include "pathscope/bvh/bvh.hpp"\n\n#include "bvh/build.hpp"\n',
    "tests/bvh/test_bvh.cpp": '#include "pathscope/bvh/bvh.hpp"\n',
    "tools/pathscope-render/main.cpp": "int main() { return 0; }\n",
    "tools/pathscope-bench/peer.cpp": "#include <embree3/rtcore.h>\n",
}


class CheckHouse(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="pathscope_house_")
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        for name, text in GOOD_TREE.items():
            self.write(name, text)
        shutil.copy(PROJECT / ".clang-format", self.root)

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def run_check(self, *arguments):
        return subprocess.run([sys.executable, str(CHECK), *arguments, str(self.root)], capture_output=True, text=True)

    def expect_break(self, place, words):
        result = self.run_check()
        lines = result.stdout.splitlines()
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertEqual(len(lines), 2, result.stdout)  # the break, and the closing line
        self.assertTrue(lines[0].startswith(place + ": "), lines[0])
        self.assertIn(words, lines[0])

    def test_a_good_tree_passes(self):
        result = self.run_check()
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("0 broken", result.stdout)

    # modules
    def test_include_of_a_module_that_the_row_does_not_list(self):
        self.write("src/net/peer.cpp", '#include <zmq.hpp>\n\n#include "pathscope/math/vec.hpp"\n')
        self.expect_break("src/net/peer.cpp:3", "net includes math")

    def test_include_upwards_in_a_public_header(self):
        self.write("include/pathscope/math/ray.hpp", '#pragma once\n#include "pathscope/bvh/bvh.hpp"\n')
        self.expect_break("include/pathscope/math/ray.hpp:2", "math includes bvh")

    def test_include_of_another_module_s_private_header(self):
        self.write("src/bvh/split.cpp", '#include "math/tables.hpp"\n')
        self.expect_break("src/bvh/split.cpp:1", "private header of math")

    def test_private_header_by_a_relative_path(self):
        self.write("src/bvh/split.cpp", '#include "../math/tables.hpp"\n')
        self.expect_break("src/bvh/split.cpp:1", "private header of math")

    def test_row_that_differs_from_the_document(self):
        self.write("CMakeLists.txt", GOOD_TREE["CMakeLists.txt"].replace("net      USES core", "net      USES core math"))
        self.expect_break("docs/architecture.md:5", "the row of net differs from its USES in CMakeLists.txt:4")

    def test_module_that_is_used_before_its_floor(self):
        for name in ("CMakeLists.txt", "docs/architecture.md"):
            self.write(name, GOOD_TREE[name].replace("math     USES core", "math     USES core net")
                       .replace("`math` | core", "`math` | core net"))
        self.expect_break("CMakeLists.txt:3", "math uses net, which is not on a floor below")

    def test_module_missing_in_the_document(self):
        self.write("docs/architecture.md", GOOD_TREE["docs/architecture.md"].replace("| 1 | `net` | core | sockets |\n", ""))
        self.expect_break("CMakeLists.txt:4", "module net has no row")

    def test_document_with_a_module_that_is_not_built(self):
        self.write("docs/architecture.md", GOOD_TREE["docs/architecture.md"] + "| 3 | `gone` | core | nothing |\n")
        self.expect_break("docs/architecture.md:9", "module gone is not in CMakeLists.txt")

    def test_folder_without_a_row(self):
        self.write("src/extra/extra.cpp", "\n")
        self.expect_break("src/extra/extra.cpp:1", "module extra has no row")

    # fences
    def test_zmq_outside_net(self):
        self.write("tools/pathscope-render/main.cpp", "#include <zmq.hpp>\nint main() { return 0; }\n")
        self.expect_break("tools/pathscope-render/main.cpp:1", "ZeroMQ is included outside")

    def test_openmp_outside_parallel_for(self):
        self.write("src/math/sum.cpp", "#pragma omp parallel\n")
        self.expect_break("src/math/sum.cpp:1", "OpenMP is used outside")

    def test_omp_header_outside_parallel_for(self):
        self.write("src/core/clock.cpp", "#include <omp.h>\n")
        self.expect_break("src/core/clock.cpp:1", "OpenMP is used outside")

    def test_window_library_outside_view(self):
        self.write("src/bvh/draw.cpp", "#include <GLFW/glfw3.h>\n")
        self.expect_break("src/bvh/draw.cpp:1", "outside the module view")

    def test_embree_outside_the_benchmarks(self):
        self.write("src/bvh/bvh.cpp", "#include <embree3/rtcore.h>\n")
        self.expect_break("src/bvh/bvh.cpp:1", "Embree is included outside")

    # mains
    def test_long_main(self):
        self.write("tools/pathscope-render/main.cpp", "int main() { return 0; }\n" + "// more\n" * 120)
        self.expect_break("tools/pathscope-render/main.cpp:121", "at most 120 lines, this file has 121")

    def test_main_of_just_120_lines_passes(self):
        self.write("tools/pathscope-render/main.cpp", "int main() { return 0; }\n" + "// more\n" * 119)
        self.assertEqual(self.run_check().returncode, 0)

    # links
    def test_comment_that_names_a_missing_file(self):
        (self.root / "tests/bvh/test_bvh.cpp").unlink()
        self.expect_break("include/pathscope/bvh/bvh.hpp:2", "tests/bvh/test_bvh.cpp is named here and does not exist")

    def test_link_that_leads_nowhere(self):
        self.write("README.md", "# Tree\n\nSee [more](docs/more.html) and [the web](https://example.org/).\n")
        self.expect_break("README.md:3", "the link to docs/more.html leads nowhere")

    # paths
    def test_folder_of_one_machine(self):
        for folder in ("ro" + "ot", "wo" + "rk", "ho" + "me/ann"):
            with self.subTest(folder=folder):
                self.write("tools/go", f"#!/bin/sh\ncd /{folder}/here\n")
                self.expect_break("tools/go:2", "a folder of one machine")

    # layout
    def test_layout(self):
        self.write("src/math/sum.cpp", "int   sum;\n")
        self.expect_break("src/math/sum.cpp:1", "run tools/format")

    # the command line
    def test_one_rule_alone(self):
        self.write("src/math/sum.cpp", "int   sum;\n")
        self.assertEqual(self.run_check("--rule", "modules").returncode, 0)
        self.assertEqual(self.run_check("--rule", "layout").returncode, 1)

    def test_a_folder_that_is_no_project(self):
        (self.root / "CMakeLists.txt").unlink()
        result = self.run_check()
        self.assertEqual(result.returncode, 2)
        self.assertIn("holds no CMakeLists.txt", result.stderr)


if __name__ == "__main__":
    unittest.main()
