"""A client that is killed and started again: real processes, kill -9 at moments that nobody chose, with and without servers.
Whatever happened, the picture has the bits of a run that nobody disturbed, and each sample was counted once.

    test_checkpoint.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from processes import cpu_seconds, free_ports

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
WIDTH, HEIGHT, SPP, DIRECT_SPP = 160, 120, 64, 8
JOB = ["--size", f"{WIDTH}x{HEIGHT}", "--direct-spp", str(DIRECT_SPP), "--seed", "7"]
OFTEN = ["--checkpoint-every", "0.02"]
KILLS = 8
PATIENCE_S = 300  # A run that takes longer has failed.


class Checkpoints(unittest.TestCase):
    undisturbed = {}  # Statistics by job: several tests compare with the same run.

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="pathscope_checkpoint_")
        self.folder = pathlib.Path(self.temporary.name)
        self.file = self.folder / "frame.ck"
        self.picture = self.folder / "image.png"
        self.stats = self.folder / "stats.json"
        self.addCleanup(self.temporary.cleanup)

    def start(self, *options, spp=SPP, **process):
        command = [BIN / "pathscope-render", SCENE, "-o", self.picture, "--stats", self.stats, *JOB]
        command += ["--spp", str(spp)] if spp else []
        environment = dict(os.environ, XDG_CACHE_HOME=str(self.folder))
        return subprocess.Popen([*command, *options], env=environment, stderr=subprocess.PIPE, text=True, **process)

    def finish(self, process, code=0):
        """Waits for the end, and returns what was said."""
        said = process.communicate(timeout=PATIENCE_S)[1]
        self.assertEqual(process.returncode, code, said)
        return said

    def run_once(self, *options, spp=SPP):
        """Statistics of a run to the end."""
        self.finish(self.start(*options, spp=spp))
        return json.loads(self.stats.read_text())

    def expected(self, *options, spp=SPP):
        if (options, spp) not in self.undisturbed:
            self.undisturbed[options, spp] = self.run_once(*options, spp=spp)
        return self.undisturbed[options, spp]

    def wait_until(self, process, happened):
        """Whether it happened before the process ended."""
        limit = time.monotonic() + PATIENCE_S
        while time.monotonic() < limit:
            if happened():
                return True
            if process.poll() is not None:
                return False
            time.sleep(0.001)
        raise AssertionError("nothing happened")

    def version_of_file(self):
        """Changes with each checkpoint that is written."""
        return self.file.stat().st_ino if self.file.exists() else 0

    def wait_for_checkpoint(self, process):
        before = self.version_of_file()
        return self.wait_until(process, lambda: self.version_of_file() != before)

    def is_writing(self):
        return any(self.folder.glob("frame.ck.part*"))

    def kill_at_some_moment(self, process, moment, rng):
        """False if the process was quicker."""
        if moment == "anywhere":
            time.sleep(rng.uniform(0, 0.5))
        elif not all(self.wait_for_checkpoint(process) for _ in range(2)):
            return False
        elif moment == "later":
            time.sleep(rng.uniform(0, 0.15))
        elif not self.wait_until(process, self.is_writing):
            return False
        if process.poll() is not None:
            return False
        process.kill()
        process.communicate()
        return True

    def check_counted_once(self, stats):
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        parts = [stats["resumed"], stats["client"], *stats["servers"]]
        self.assertEqual(sum(part["samples"] for part in parts if part), stats["samples"])
        self.assertEqual(sum(part["rays"] for part in parts if part), stats["rays"])

    def check_killed(self, cluster, job, seed):
        spp = 2 * SPP
        expected = self.expected(*job, spp=spp)
        rng = random.Random(seed)
        moments = (["anywhere"] * 2 + ["later"] * 3 + ["while writing"] * 3)[:KILLS]
        rng.shuffle(moments)
        killed = 0
        for moment in moments:
            process = self.start(*job, *cluster, *OFTEN, "--continue", self.file, spp=spp)
            if not self.kill_at_some_moment(process, moment, rng):
                self.finish(process)
                break
            killed += 1
        self.assertGreaterEqual(killed, KILLS // 2, "the job is too short for this machine")
        stats = self.run_once(*job, *cluster, "--continue", self.file, spp=spp)
        self.assertEqual(stats["image_hash"], expected["image_hash"])
        self.assertEqual(stats["samples"], expected["samples"])
        self.assertEqual(stats["rounds"], expected["rounds"])
        self.check_counted_once(stats)
        self.assertGreaterEqual(stats["resumed"]["runs"], 1)
        self.assertGreater(stats["resumed"]["samples"], 0)
        self.assertEqual([path.name for path in self.folder.glob("frame.ck*")], ["frame.ck"])

    def test_killed_alone(self):
        self.check_killed([], [], seed=1)
        self.assertEqual(self.expected(spp=2 * SPP)["samples"], WIDTH * HEIGHT * (2 * SPP + DIRECT_SPP))

    def test_killed_with_servers(self):
        self.check_killed(["--servers", "2"], [], seed=2)

    def test_killed_with_adaptive_rounds(self):
        self.check_killed([], ["--adaptive", "on"], seed=3)

    def test_killed_with_a_filter(self):
        self.check_killed(["--servers", "2"], ["--filter", "client"], seed=4)

    def test_a_server_outlives_its_client(self):
        expected = self.expected()
        ports = free_ports()
        cluster = ["--listen", "127.0.0.1", "--ports", ports]
        environment = dict(os.environ, XDG_CACHE_HOME=str(self.folder))
        server = subprocess.Popen([BIN / "pathscope-server", "--ports", ports, "--name", "loyal", "--quiet"],
                                  env=environment)
        self.addCleanup(server.wait)
        self.addCleanup(server.kill)
        process = self.start(*cluster, *OFTEN, "--checkpoint", self.file)
        self.assertTrue(self.wait_for_checkpoint(process))
        self.assertTrue(self.wait_for_checkpoint(process))
        process.kill()
        process.communicate()
        stats = self.run_once(*cluster, "--resume", self.file)
        self.assertEqual(stats["image_hash"], expected["image_hash"])
        self.check_counted_once(stats)
        self.assertEqual([one["name"] for one in stats["servers"]], ["loyal"])
        self.assertIsNone(server.poll())

    def test_interrupted(self):
        spp = 4 * SPP
        for number in signal.SIGINT, signal.SIGTERM:
            with self.subTest(number.name):
                self.file.unlink(missing_ok=True)
                # No checkpoint but that of the end: that it renders is seen by what it costs.
                process = self.start("--checkpoint", self.file, "--checkpoint-every", "1000", spp=spp)
                self.assertTrue(self.wait_until(process, lambda: cpu_seconds(process.pid) > 0.5))
                process.send_signal(number)
                self.assertIn(f"--resume {self.file}", self.finish(process, code=1))
                self.assertFalse(self.picture.exists())
                stats = self.run_once("--resume", self.file, spp=spp)
                self.assertEqual(stats["image_hash"], self.expected(spp=spp)["image_hash"])
                self.check_counted_once(stats)
                self.assertGreater(stats["resumed"]["render_s"], 0)
                self.picture.unlink()

    def test_more_samples(self):
        half = self.run_once("--checkpoint", self.file, spp=SPP // 2)
        self.assertIsNone(half["resumed"])
        whole = self.run_once("--resume", self.file)
        self.assertEqual(whole["image_hash"], self.expected()["image_hash"])
        self.assertEqual(whole["resumed"]["samples"], half["samples"])
        self.assertEqual(whole["resumed"]["rounds"], half["rounds"])
        # The file was not written to: it was not asked for.
        self.assertEqual(self.run_once("--resume", self.file, spp=SPP // 2)["image_hash"], half["image_hash"])

    def test_a_time_limit_and_another(self):
        self.run_once("--checkpoint", self.file, "--seconds", "0.3", spp=None)
        self.run_once("--resume", self.file, "--checkpoint", self.file, "--seconds", "0.3", spp=None)
        stats = self.run_once("--resume", self.file, spp=SPP * 4)
        self.check_counted_once(stats)
        self.assertEqual(stats["samples"], WIDTH * HEIGHT * (SPP * 4 + DIRECT_SPP))
        self.assertEqual(stats["resumed"]["runs"], 2)
        self.assertEqual(stats["image_hash"], self.run_once(spp=SPP * 4)["image_hash"])

    def test_a_folder_that_goes_away(self):
        place = self.folder / "place"
        place.mkdir()
        self.file = place / "frame.ck"
        process = self.start("--checkpoint", self.file, *OFTEN)
        self.assertTrue(self.wait_for_checkpoint(process))
        place.rename(self.folder / "elsewhere")
        said = self.finish(process)
        self.assertEqual(said.count("Rendering goes on"), 1, said)
        self.assertEqual(said.count("Cannot write"), 1, said)
        self.assertEqual(json.loads(self.stats.read_text())["image_hash"], self.expected()["image_hash"])
        stats = self.run_once("--resume", self.folder / "elsewhere" / "frame.ck")
        self.assertEqual(stats["image_hash"], self.expected()["image_hash"])

    def test_a_disk_that_is_full(self):
        # A limit on the size of files: what write() says then is another word, and all else is the same. The first
        # checkpoints, of a frame that is mostly black, are below it.
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        process = self.start("--checkpoint", self.file, *OFTEN, preexec_fn=limit, restore_signals=False)
        said = self.finish(process)
        self.assertEqual(said.count("Rendering goes on"), 1, said)
        self.assertEqual(said.count("Cannot write"), 1, said)
        self.assertIn("frame.ck: File too large", said)
        self.assertEqual(json.loads(self.stats.read_text())["image_hash"], self.expected()["image_hash"])
        self.assertFalse(self.is_writing())
        if self.file.exists():
            self.assertEqual(self.run_once("--resume", self.file)["image_hash"], self.expected()["image_hash"])

    def test_refused(self):
        self.run_once("--checkpoint", self.file, spp=4)
        self.picture.unlink()
        whole = self.file.read_bytes()
        damaged, cut, empty = (self.folder / name for name in ("damaged.ck", "cut.ck", "empty.ck"))
        damaged.write_bytes(whole[:len(whole) // 2] + bytes([whole[len(whole) // 2] ^ 1]) + whole[len(whole) // 2 + 1:])
        cut.write_bytes(whole[:len(whole) // 2])
        empty.write_bytes(b"")
        cases = [
            (["--resume", damaged], "damaged.ck is damaged"),
            (["--continue", damaged], "damaged.ck is damaged"),
            (["--resume", cut], "cut.ck is damaged"),
            (["--resume", empty], "empty.ck is no checkpoint"),
            (["--resume", SCENE], "is no checkpoint"),
            (["--resume", self.folder / "none.ck"], "none.ck: No such file"),
            (["--resume", self.folder], "is a folder"),
            (["--checkpoint", self.file], f"add --resume {self.file}"),
            (["--checkpoint", self.folder / "no" / "f.ck"], "make it first"),
            (["--continue", self.folder / "no" / "f.ck"], "make it first"),
            (["--resume", self.file, "--block", "16"], "its --block is 32, not 16"),
            (["--resume", self.file, "--light", "area"], "its --light is tree, not area"),
            (["--resume", self.file, "--adaptive", "on"], "its --adaptive is off, not on"),
            (["--resume", self.file, "--camera", "none"], "--camera none"),
            (["--continue", self.file, "--resume", self.file], "--resume"),
            (["--checkpoint-every", "1"], "--checkpoint-every"),
        ]
        for words, named in cases:
            with self.subTest(words):
                said = self.finish(self.start(*words, spp=8), code=2)
                self.assertIn(named.lower(), said.strip().splitlines()[-1].lower())
                self.assertFalse(self.picture.exists())
        self.assertEqual(self.file.read_bytes(), whole)


if __name__ == "__main__":
    unittest.main(verbosity=2)
