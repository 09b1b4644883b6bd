"""Real processes, real faults: a client and three render servers on this machine, of which some are killed, frozen or
come late. Whatever happens, the image has the same bits as the render without servers, and every round counts once.

    test_faults.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from processes import cpu_seconds, free_ports

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
JOB = ["--size", "200x150", "--spp", "96", "--direct-spp", "8", "--seed", "7"]
PATIENCE_S = 300  # A run that takes longer has failed.


class Run:
    """One pathscope-render, its server processes and its statistics."""

    def __init__(self, folder, *options):
        self.stats_file = pathlib.Path(folder) / "stats.json"
        self.stats_file.unlink(missing_ok=True)
        command = [BIN / "pathscope-render", SCENE, "-o", pathlib.Path(folder) / "image.pfm", "--stats",
                   self.stats_file, *JOB, *options]
        environment = dict(os.environ, XDG_CACHE_HOME=str(folder))
        self.process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)

    def servers(self):
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return [int(pid) for pid in children.read_text().split()]

    def working_servers(self, count):
        """Waits until so many of its own servers are at work."""
        return self.wait_until_busy(self.servers, count)

    def wait_until_busy(self, processes, count):
        """Their own CPU time says so; the scene loads in no time."""
        limit = time.monotonic() + PATIENCE_S
        while time.monotonic() < limit and self.process.poll() is None:
            busy = [pid for pid in processes() if cpu_seconds(pid) > 0.4]
            if len(busy) >= count:
                return busy
            time.sleep(0.005)
        raise AssertionError("the servers did not get to work: " + self.finish_text())

    def finish_text(self):
        return self.process.communicate(timeout=PATIENCE_S)[1]

    def finish(self):
        self.said = self.finish_text()
        if self.process.returncode != 0:
            raise AssertionError(f"exit code {self.process.returncode}: {self.said}")
        return json.loads(self.stats_file.read_text())


def start_server(folder, ports, name):
    """A server as on another machine: no child of the client."""
    environment = dict(os.environ, XDG_CACHE_HOME=folder)
    return subprocess.Popen([BIN / "pathscope-server", "--ports", ports, "--name", name, "--quiet"], env=environment)


class Faults(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = cls.temporary.name
        cls.expected = Run(cls.folder, "--servers", "0").finish()["image_hash"]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def check(self, stats, died):
        self.assertEqual(stats["image_hash"], self.expected)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        self.assertEqual(stats["bad_messages"], 0)
        self.assertEqual(sum(server["died"] for server in stats["servers"]), died, stats["servers"])

    def test_three_servers_without_a_fault(self):
        stats = Run(self.folder, "--servers", "3").finish()
        self.check(stats, died=0)
        self.assertEqual(stats["client"]["samples"], 200 * 150 * 8)  # Direct light alone.

    def test_static_schedule_and_small_blocks(self):
        self.check(Run(self.folder, "--servers", "2", "--schedule", "static", "--block", "16").finish(), died=0)

    def test_kill_9(self):
        run = Run(self.folder, "--servers", "3")
        os.kill(run.working_servers(3)[0], signal.SIGKILL)
        stats = run.finish()
        self.check(stats, died=1)
        self.assertGreaterEqual(stats["reallocated"], 1)

    def test_kill_9_of_another_machines_server(self):
        """It is no child of the client: the end of its connection alone tells, long before heartbeats would."""
        ports = free_ports()
        run = Run(self.folder, "--servers", "1", "--listen", "127.0.0.1", "--ports", ports)
        run.working_servers(1)
        other = start_server(self.folder, ports, "other")
        run.wait_until_busy(lambda: [other.pid], 1)
        other.kill()
        other.wait()
        stats = run.finish()
        self.check(stats, died=1)
        self.assertIn("other is lost: Its connection is gone.", run.said)

    def freeze(self, count):
        """Of three servers, so many; the statistics of the run."""
        run = Run(self.folder, "--servers", "3")
        frozen = run.working_servers(3)[:count]
        for pid in frozen:
            os.kill(pid, signal.SIGSTOP)
        stats = run.finish()
        for pid in frozen:
            self.assertFalse(pathlib.Path(f"/proc/{pid}").exists(), "a frozen server was left behind")
        return stats

    def test_one_frozen(self):
        """The others may be done before its silence is long enough to be called its death."""
        stats = self.freeze(1)
        self.check(stats, died=sum(server["died"] for server in stats["servers"]))

    def test_all_frozen(self):
        """The frame cannot end before all of them are given up."""
        self.check(self.freeze(3), died=3)

    def test_all_killed_S13(self):
        run = Run(self.folder, "--servers", "3")
        for pid in run.working_servers(3):
            os.kill(pid, signal.SIGKILL)
        stats = run.finish()
        self.check(stats, died=3)
        self.assertGreater(stats["client"]["samples"], 200 * 150 * 8)

    def test_client_killed_leaves_no_server(self):
        run = Run(self.folder, "--servers", "3")
        servers = run.working_servers(3)
        run.process.kill()
        run.process.communicate()
        limit = time.monotonic() + PATIENCE_S
        while any(pathlib.Path(f"/proc/{pid}").exists() for pid in servers) and time.monotonic() < limit:
            time.sleep(0.01)
        self.assertEqual([pid for pid in servers if pathlib.Path(f"/proc/{pid}").exists()], [])

    def test_late_server(self):
        ports = free_ports()
        run = Run(self.folder, "--servers", "1", "--listen", "127.0.0.1", "--ports", ports)
        run.working_servers(1)
        late = start_server(self.folder, ports, "late")
        stats = run.finish()
        late.terminate()
        self.assertEqual(late.wait(timeout=PATIENCE_S), 0)
        self.check(stats, died=0)
        samples = {server["name"]: server["samples"] for server in stats["servers"]}
        self.assertEqual(set(samples), {"server-1", "late"})
        self.assertGreater(samples["late"], 0)

    def test_told_to_end_at_once(self):
        """A program that has just begun, and has threads already, ends as it is told: with exit code 0."""
        for program in ("pathscope-server", "pathscope-relay"):
            for _ in range(5):
                command = [BIN / program, "--quiet"] + (["--listen", "127.0.0.1", "--listen-ports", free_ports()] if program == "pathscope-relay" else [])
                process = subprocess.Popen(command, env=dict(os.environ, XDG_CACHE_HOME=self.folder), stderr=subprocess.PIPE, text=True)
                status = pathlib.Path(f"/proc/{process.pid}/status")
                catches, threads = False, 0
                while not catches and process.poll() is None:
                    fields = dict(line.split(":\t", 1) for line in status.read_text().splitlines() if ":\t" in line)
                    catches = int(fields.get("SigCgt", "0"), 16) >> signal.SIGTERM - 1 & 1
                    threads = int(fields.get("Threads", "0"))
                    self.assertFalse(threads > 1 and not catches, f"{program} has {threads} threads, and SIGTERM would kill it")
                process.terminate()
                said = process.communicate(timeout=PATIENCE_S)[1]
                self.assertEqual(process.returncode, 0, f"{program}: {said}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
