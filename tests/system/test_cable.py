"""The cable between client and servers, pulled and put back: two network namespaces joined by a veth pair, the client and one
near server in one of them, two far servers in the other, with keys, as between machines. Nobody is told that the cable is out:
connections stay open, and nothing comes. The image has the same bits as the render without servers, and every sample counts once.

    test_cable.py BIN      BIN: the folder of pathscope-render and pathscope-server

Needs the right to make network namespaces (root, in a container with that right); else it is skipped, and says so.
Nothing is left behind, however this ends: a namespace lives as long as the process that holds it, which ends with the pipe from
here, and programs in it are killed when this one is gone.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

from processes import cpu_seconds, wait_for

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
WIDTH, HEIGHT, SPP, DIRECT_SPP = 160, 120, 240, 4
JOB = ["--size", f"{WIDTH}x{HEIGHT}", "--spp", str(SPP), "--direct-spp", str(DIRECT_SPP), "--seed", "7"]
NEAR, FAR = "10.77.0.1", "10.77.0.2"
NEAR_CAP, FAR_CAP = 150_000, 300_000  # Samples per second: the frame lasts for long enough, on any machine.
PATIENCE_S = 300  # A run that takes longer has failed.


class Namespace:
    """A network of its own, held by a process that does nothing."""

    def __init__(self):
        self.holder = subprocess.Popen(["unshare", "--net", "sh", "-c", "echo here; exec cat"], stdin=subprocess.PIPE,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if self.holder.stdout.readline() != "here\n":
            raise unittest.SkipTest(f"no right to make network namespaces ({self.holder.stderr.read().strip()})")

    def enter(self, *command):
        return ["nsenter", f"--net=/proc/{self.holder.pid}/ns/net", *map(str, command)]

    def ip(self, *words):
        done = subprocess.run(self.enter("ip", *words), capture_output=True, text=True)
        if done.returncode != 0:
            raise unittest.SkipTest(f"no right to lay a cable between network namespaces (ip {' '.join(words)}: {done.stderr.strip()})")

    def start(self, folder, name, *arguments):
        """A program in it; a file in `folder` takes what it says."""
        environment = dict(os.environ, XDG_CACHE_HOME=str(folder), TMPDIR=str(folder))
        with open(pathlib.Path(folder) / f"{name}-{time.monotonic_ns()}.log", "w") as log:
            process = subprocess.Popen(self.enter("setpriv", "--pdeathsig", "KILL", BIN / name, *arguments), env=environment, stderr=log,
                                       stdout=subprocess.DEVNULL)
        process.log = pathlib.Path(log.name)
        return process

    def close(self):
        self.holder.communicate()


def setUpModule():
    global near, far
    if os.geteuid() != 0:
        raise unittest.SkipTest("no right to make network namespaces (only root has it)")
    near = Namespace()
    unittest.addModuleCleanup(near.close)
    far = Namespace()
    unittest.addModuleCleanup(far.close)
    near.ip("link", "add", "name", "cable", "type", "veth", "peer", "name", "cable", "netns", str(far.holder.pid))
    for namespace, address in ((near, NEAR), (far, FAR)):
        namespace.ip("link", "set", "lo", "up")
        namespace.ip("address", "add", f"{address}/24", "dev", "cable")
        namespace.ip("link", "set", "cable", "up")


def pull():
    """The far end goes down; the near one loses its carrier, and that is all that anybody learns."""
    far.ip("link", "set", "cable", "down")


def put_back():
    far.ip("link", "set", "cable", "up")


class Cable(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        for who, program in (("client", "render"), ("server", "server")):
            subprocess.run([BIN / f"pathscope-{program}", "--keygen", cls.folder / who], check=True, stdout=subprocess.DEVNULL)
        (cls.folder / "allowed").write_text((cls.folder / "server.pub").read_text())
        alone = near.start(cls.folder, "pathscope-render", *cls.frame(), *JOB)
        cls.expected = cls.finish(alone)["image_hash"]

    @classmethod
    def frame(cls):
        return [SCENE, "-o", cls.folder / "image.pfm", "--stats", cls.folder / "stats.json"]

    @classmethod
    def finish(cls, render):
        try:
            code = render.wait(PATIENCE_S)
        finally:
            render.kill()
            render.wait()
        if code != 0:
            raise AssertionError(f"exit code {code}: {render.log.read_text()}")
        return json.loads((cls.folder / "stats.json").read_text())

    def start(self, *options):
        self.addCleanup(put_back)  # Before the processes end, or the next test begins.
        self.render = near.start(self.folder, "pathscope-render", *self.frame(), *JOB, "--listen", NEAR, "--min-servers", "3", "--key",
                                 self.folder / "client", "--allow", self.folder / "allowed", *options)
        self.addCleanup(self.end, self.render)
        self.servers = [self.start_server(*one) for one in ((near, "near", NEAR_CAP), (far, "far-1", FAR_CAP), (far, "far-2", FAR_CAP))]
        wait_for(lambda: all(cpu_seconds(server.pid) > 0.3 for server in self.servers[1:]), "the far servers to work", PATIENCE_S)
        self.assertIsNone(self.render.poll(), "the frame was over before the cable was pulled")

    def start_server(self, namespace, name, cap):
        server = namespace.start(self.folder, "pathscope-server", "--connect", NEAR, "--name", name, "--threads", "1", "--speed-cap", cap,
                                 "--key", self.folder / "server", "--server-key", self.folder / "client.pub")
        self.addCleanup(self.end, server)
        return server

    @staticmethod
    def end(process):
        process.kill()
        process.wait()

    def check(self, stats):
        self.assertEqual(stats["image_hash"], self.expected)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        everybody = [stats["client"], *stats["servers"]]
        self.assertEqual(sum(one["samples"] for one in everybody), WIDTH * HEIGHT * (SPP + DIRECT_SPP))
        for server in self.servers:
            self.assertIsNone(server.poll(), server.log.read_text())
        return {name: [server for server in stats["servers"] if server["name"] == name] for name in ("near", "far-1", "far-2")}

    def test_pulled_for_longer_than_detection_takes(self):
        self.start()
        pull()
        wait_for(lambda: self.render.log.read_text().count(" is lost: It has been silent") == 2, "the far servers to be given up", PATIENCE_S)
        time.sleep(2)  # The near one works on.
        put_back()
        lives = self.check(self.finish(self.render))
        self.assertEqual([server["died"] for server in lives["near"]], [False])
        for name in ("far-1", "far-2"):
            self.assertEqual([server["died"] for server in lives[name]], [True, False], "it joined again, once")
            self.assertTrue(all(server["samples"] > 0 for server in lives[name]), lives[name])

    def test_pulled_for_shorter_than_detection_takes(self):
        """The detector `fixed` bears six seconds of silence: nobody is lost, and what was on its way comes late."""
        self.start("--detector", "fixed")
        pull()
        time.sleep(2)
        put_back()
        stats = self.finish(self.render)
        lives = self.check(stats)
        self.assertEqual(stats["bad_messages"], 0)  # Else there are those that a server said before it knew that it was given up.
        for name, of_name in lives.items():
            self.assertEqual([server["died"] for server in of_name], [False], name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
