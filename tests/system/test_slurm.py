"""A real Slurm starts the servers, by tools/cluster/slurm/servers.sbatch: an array of 16, of which three are killed, one is drained and one
requeued while the frame is rendered. The image has the bits of the render without servers, and no process is left.
Skipped, with a word, where Debian's Slurm packages cannot be had.

    test_slurm.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest
import urllib.request

from processes import free_ports, wait_for
from small_slurm import CannotBeHad, SmallSlurm

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
SCRIPT = pathlib.Path("tools/cluster/slurm/servers.sbatch").resolve()
JOB = ["--size", "64x48", "--spp", "24", "--direct-spp", "1", "--seed", "7", "--block", "8", "--round", "2"]
SPEED_CAP = 64  # Samples per second: the frame would take 16 servers over a minute, a round 2 s. A quick one ends it.
SERVERS = 16
PATIENCE_S = 120  # What takes longer has failed.


class Slurm(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory(prefix="pathscope-slurm-")
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = pathlib.Path(temporary.name)
        try:
            cls.slurm = SmallSlurm(cls.folder)
            cls.addClassCleanup(cls.end)
            cls.slurm.start()
        except CannotBeHad as why:
            raise unittest.SkipTest(f"no Slurm to test with: {why}") from None

    @classmethod
    def end(cls):
        cls.slurm.stop()
        left = cls.slurm.processes()
        for pid in left:
            os.kill(pid, signal.SIGKILL)
        assert not left, f"still running: {left}"

    def setUp(self):
        self.log = self.folder / "client.log"
        self.ports = free_ports()

    def render(self, *options):
        with open(self.log, "w") as log:
            process = subprocess.Popen([BIN / "pathscope-render", SCENE, "-o", self.folder / "a.pfm", "--stats",
                                        self.folder / "stats.json", *JOB, *options], stderr=log)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def finish(self, process):
        self.assertEqual(process.wait(PATIENCE_S), 0, self.log.read_text())
        return json.loads((self.folder / "stats.json").read_text())

    def wait_for(self, condition, what, process):
        def met():
            found = condition()
            if not found:
                self.assertIsNone(process.poll(), f"The client ended while we waited for {what}: {self.log.read_text()}")
            return found
        return wait_for(met, what, PATIENCE_S, pause_s=0.1)

    def metric(self, url, line):
        text = urllib.request.urlopen(url, timeout=PATIENCE_S).read().decode()
        return float(re.search(rf"^{re.escape(line)} (\S+)$", text, re.MULTILINE).group(1))

    def pid_of(self, name):
        (pid,) = [pid for pid, command in self.slurm.processes().items() if f" --name {name} " in command]
        return pid

    def test_an_array_of_sixteen(self):
        expected = self.finish(self.render())["image_hash"]
        client = self.render("--listen", "127.0.0.1", "--ports", self.ports, "--min-servers", str(SERVERS), "--metrics",
                             "127.0.0.1:0")
        url = self.wait_for(lambda: re.search(r"http://\S+/metrics", self.log.read_text()), "the metrics", client).group(0)
        job = self.slurm.run("sbatch", "--parsable", f"--array=0-{SERVERS - 1}", f"--output={self.folder}/server-%a.log", SCRIPT,
                             "--speed-cap", SPEED_CAP, PATHSCOPE_CLIENT="127.0.0.1", PATHSCOPE_PORTS=self.ports,
                             PATHSCOPE_BIN=str(BIN), PATHSCOPE_CACHE=str(self.folder / "cache"))
        name = lambda element, restarts=0: f"slurm-{job}.{element}.{restarts}"
        said = lambda words: lambda: words in self.log.read_text()
        self.wait_for(lambda: self.metric(url, 'pathscope_servers{state="ready"}') == SERVERS, "all servers", client)

        for element in 0, 1, 2:
            os.kill(self.pid_of(name(element)), signal.SIGKILL)
        self.slurm.run("scancel", "--batch", "--signal=TERM", f"{job}_3")
        self.slurm.run("scontrol", "requeue", f"{job}_4")
        for element in 0, 1, 2:
            self.wait_for(said(f"{name(element)} is lost"), f"the death of element {element}", client)
        for element in 3, 4:
            self.wait_for(said(f"{name(element)} left"), f"the goodbye of element {element}", client)
        self.wait_for(lambda: self.metric(url, "pathscope_servers_joined_total") == SERVERS + 1, "the requeued element", client)
        self.wait_for(lambda: self.pid_of(name(4, 1)), "its second life", client)
        self.assertEqual(self.metric(url, "pathscope_died_total"), 3)
        # Enough was seen: a server without a cap ends the frame.
        quick = subprocess.Popen([BIN / "pathscope-server", "--ports", self.ports, "--name", "quick", "--threads", "2", "--quiet"],
                                 env=dict(os.environ, XDG_CACHE_HOME=str(self.folder)))
        self.addCleanup(quick.wait)
        self.addCleanup(quick.kill)
        stats = self.finish(client)

        self.assertEqual(stats["image_hash"], expected)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        servers = {server["name"]: server for server in stats["servers"]}
        self.assertEqual({server for server in servers if servers[server]["died"]}, {name(0), name(1), name(2)})
        self.assertGreater(sum(servers[name(element)]["tiles"] for element in range(5, SERVERS)), 0)
        # The array waits for the next client, until it is cancelled.
        self.assertTrue(self.slurm.run("squeue", "--noheader"))
        self.slurm.run("scancel", job)
        self.wait_for(lambda: not self.slurm.run("squeue", "--noheader"), "the end of the array", quick)


if __name__ == "__main__":
    unittest.main()
