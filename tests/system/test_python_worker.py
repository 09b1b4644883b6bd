"""A server in another language: tools/python-worker, which was written from docs/protocol.md alone, takes part in frames of the strategy
`flat`. What the picture must be is arithmetic: after n samples 2^20 * (512, (n - 1) / 2, x + y) quanta in each pixel of the block at (x, y),
to the last bit.

    test_python_worker.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

from processes import free_ports, wait_for

sys.dont_write_bytecode = True
sys.path.insert(0, "tools/cycles")
from pictures import read_pfm  # noqa: E402

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
WIDTH, HEIGHT, SPP, BLOCK = 100, 70, 32, 32
PATIENCE_S = 60  # What takes longer has failed.


class PythonWorker(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.environment = dict(os.environ, XDG_CACHE_HOME=temporary.name)
        self.ports = free_ports()

    def start(self, *command):
        log = open(self.folder / f"{time.monotonic_ns()}.log", "w+")
        process = subprocess.Popen([str(word) for word in command], env=self.environment, stderr=log)
        process.log = log
        self.addCleanup(log.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def said(self, process):
        process.log.flush()
        return pathlib.Path(process.log.name).read_text()

    def client(self, *options, strategy="flat"):
        return self.start(BIN / "pathscope-render", SCENE, "-o", self.folder / "image.pfm", "--stats", self.folder / "stats.json",
                          "--size", f"{WIDTH}x{HEIGHT}", "--spp", SPP, "--block", BLOCK, "--indirect-only", "--strategy", strategy,
                          "--listen", "127.0.0.1", "--ports", self.ports, *options)

    def tiles_of(self, client):
        """How many came so far, by its page of metrics."""
        url = re.search(r"http://\S+/metrics", self.said(client))
        if not url:
            return 0
        page = urllib.request.urlopen(url[0], timeout=PATIENCE_S).read().decode()
        return sum(float(value) for value in re.findall(r"^pathscope_tiles_total\S* (\S+)$", page, re.MULTILINE))

    def worker(self, name, seconds_per_tile=0.0):
        return self.start("tools/python-worker", "--ports", self.ports, "--name", name, "--seconds-per-tile",
                          seconds_per_tile)

    def server(self, name):
        return self.start(BIN / "pathscope-server", "--ports", self.ports, "--name", name, "--threads", "1", "--quiet")

    def finish(self, client):
        self.assertEqual(client.wait(PATIENCE_S), 0, self.said(client))
        stats = json.loads((self.folder / "stats.json").read_text())
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        quantum = 2.0 ** (20 + stats["quantum_exponent"])
        width, height, values = read_pfm(self.folder / "image.pfm")
        self.assertEqual((width, height), (WIDTH, HEIGHT))
        for y in range(height):
            for x in range(width):
                pixel = 3 * ((height - 1 - y) * width + x)  # Its rows go up.
                corner = x // BLOCK * BLOCK + y // BLOCK * BLOCK
                self.assertEqual(tuple(values[pixel:pixel + 3]), (512 * quantum, (SPP - 1) / 2 * quantum, corner * quantum))
        return stats, {server["name"]: server for server in stats["servers"]}

    def test_it_joins_is_kept_alive_and_renders_all_of_the_frame(self):
        client, worker = self.client(), self.worker("python", 0.02)  # 96 tiles, 2 seconds: some heartbeats.
        stats, servers = self.finish(client)
        self.assertEqual((stats["servers_joined"], stats["died"], stats["bad_messages"]), (1, 0, 0))
        self.assertEqual((servers["python"]["tiles"], servers["python"]["samples"]), (stats["rounds"], WIDTH * HEIGHT * SPP))
        self.assertGreater(servers["python"]["rtt_ms_p50"], 0)
        self.assertIsNone(worker.poll(), "it looks for the next client")
        worker.send_signal(signal.SIGTERM)
        self.assertEqual(worker.wait(PATIENCE_S), 0)
        self.assertEqual(self.said(worker), "")

    def test_beside_a_server_of_ours(self):
        """Each has its own blocks: else ours would be done before the other's first tile."""
        client = self.client("--min-servers", "2", "--schedule", "static")
        self.worker("python", 0.005)
        self.server("ours")
        stats, servers = self.finish(client)
        self.assertEqual((stats["died"], stats["bad_messages"]), (0, 0))
        self.assertGreater(servers["python"]["tiles"], 0)
        self.assertGreater(servers["ours"]["tiles"], 0)

    def test_workers_that_are_killed_that_leave_and_that_come(self):
        client = self.client("--min-servers", "3", "--metrics", "127.0.0.1:0")
        first, second, _ = (self.worker(f"python-{i}", 0.05) for i in range(3))
        wait_for(lambda: self.tiles_of(client) >= 6, "tiles", PATIENCE_S)
        first.kill()
        second.send_signal(signal.SIGTERM)
        self.worker("late")
        stats, _ = self.finish(client)  # A tile may come after the BYE that overtook it, and is then nobody's.
        self.assertLessEqual(stats["died"], 1)
        self.assertEqual(second.wait(PATIENCE_S), 0)

    def test_a_picture_does_not_take_its_tiles(self):
        """With the strategy `blocks`, a foreign build is refused: its bits would not be ours."""
        client, worker = self.client("--min-servers", "1", strategy="blocks"), self.worker("python")
        self.assertEqual(worker.wait(PATIENCE_S), 1)
        self.assertIn("Run the same build", self.said(worker))
        self.assertIn("Refused the server python", self.said(client))
        self.server("ours")
        self.assertEqual(client.wait(PATIENCE_S), 0, self.said(client))
        stats = json.loads((self.folder / "stats.json").read_text())
        self.assertEqual([server["name"] for server in stats["servers"]], ["ours"])

    def test_it_is_a_page_or_two(self):
        self.assertLessEqual(len(pathlib.Path("tools/python-worker").read_text().splitlines()), 150)

    def test_no_checkpoint_mixes_strategies(self):
        client = self.client("--checkpoint", self.folder / "a.ck")
        self.assertEqual(client.wait(PATIENCE_S), 2)
        self.assertIn("--strategy flat", self.said(client))


if __name__ == "__main__":
    unittest.main()
