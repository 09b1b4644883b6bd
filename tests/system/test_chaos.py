"""Real processes over a bad line: a client and servers that reach it through pathscope-chaos, which delays, throttles, cuts,
half-closes and blackholes their connections, and flips their bits. Whatever it does, the image has the same bits as the render without servers, and
every round counts once.

    test_chaos.py BIN      BIN: the folder of pathscope-render, pathscope-server and pathscope-chaos
"""
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

from processes import free_ports

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
JOB = ["--size", "160x120", "--spp", "384", "--direct-spp", "4", "--seed", "7"]
PATIENCE_S = 300  # A run that takes longer has failed.


class Chaos:
    """One pathscope-chaos in front of the client's ports."""

    def __init__(self, folder, target_ports, schedule, *options):
        self.stats_file = pathlib.Path(folder) / "chaos.json"
        file = pathlib.Path(folder) / "schedule"
        file.write_text(schedule)
        self.process = subprocess.Popen(
            [BIN / "pathscope-chaos", "--listen", "127.0.0.1:0,0,0", "--connect", f"127.0.0.1:{target_ports}",
             "--schedule", file, "--stats", self.stats_file, *options],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        assert line.startswith("listening 127.0.0.1:"), line
        self.ports = line.strip().rpartition(":")[2]

    def finish(self, send_signal=signal.SIGTERM):
        self.process.send_signal(send_signal)
        _, errors = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0 and errors == "", f"exit code {self.process.returncode}: {errors}"
        return json.loads(self.stats_file.read_text())


class Cluster(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = cls.temporary.name
        cls.environment = dict(os.environ, XDG_CACHE_HOME=cls.folder)
        cls.expected = cls.finish_render(cls.start_render())["image_hash"]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def start_render(cls, *options):
        folder = pathlib.Path(cls.folder)
        return subprocess.Popen([BIN / "pathscope-render", SCENE, "-o", folder / "image.pfm", "--stats", folder / "stats.json",
                                 *JOB, *options], env=cls.environment, stderr=subprocess.PIPE, text=True)

    @classmethod
    def finish_render(cls, process):
        text = process.communicate(timeout=PATIENCE_S)[1]
        if process.returncode != 0:
            raise AssertionError(f"exit code {process.returncode}: {text}")
        return json.loads((pathlib.Path(cls.folder) / "stats.json").read_text())

    def render_through(self, schedule, servers=2, speed_cap=400_000):
        """Servers are slowed down, so that the faults come while they work, on any machine."""
        ports = free_ports()
        render = self.start_render("--listen", "127.0.0.1", "--ports", ports, "--min-servers", "1")
        chaos = Chaos(self.folder, ports, schedule)
        server_processes = [
            subprocess.Popen([BIN / "pathscope-server", "--ports", chaos.ports, "--name", f"far-{i}", "--threads", "1",
                              "--speed-cap", str(speed_cap), "--quiet"], env=self.environment, stderr=subprocess.DEVNULL)
            for i in range(servers)]
        try:
            stats = self.finish_render(render)
        finally:
            for process in [*server_processes, render]:
                process.kill()
                process.wait()
            faults = chaos.finish()
        self.assertEqual(stats["image_hash"], self.expected)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        self.assertGreater(sum(server["samples"] for server in stats["servers"]), 0, "no server did any work")
        for link in faults["links"]:
            for way in ("up", "down"):
                self.assertGreaterEqual(link[way]["bytes_in"], link[way]["bytes_out"] + link[way]["bytes_dropped"])
        return stats, faults

    def test_delay_jitter_and_rate(self):
        stats, faults = self.render_through("0s fault delay 10ms jitter 10ms\n0s fault rate 500kB/s up\n")
        for server in stats["servers"]:
            self.assertGreaterEqual(server["rtt_ms_p50"], 20)  # Two delays at least.
        frames = faults["links"][2]
        # The rate holds per connection, each of which may begin with what flows in 10 ms.
        self.assertGreaterEqual(stats["wall_s"], (frames["up"]["bytes_out"] / frames["connections"] - 5_000) / 500_000)

    def test_cuts_every_half_second(self):
        """For four seconds: each takes leases and tiles along, which are then waited for until their leases end."""
        cuts = "".join(f"{0.5 * i}s fault cut\n" for i in range(1, 9))
        _, faults = self.render_through("0s fault delay 2ms jitter 2ms\n" + cuts)
        for link in faults["links"]:
            self.assertGreaterEqual(link["cuts"], 4)
            self.assertGreater(link["connections"], link["cuts"])  # Servers dialled again after each.

    def test_half_close_and_refusal(self):
        """Refused are the first to dial, for whom the client waits, and those that are cut off: if it has not rendered the rest
        by itself before they dial again. Again and again, for on a busy machine servers may come late."""
        again = "".join(f"{t}ms fault half-close up link 3\n{t + 400}ms fault half-close down link 2\n{t + 800}ms fault refuse on\n"
                        f"{t + 900}ms fault cut\n{t + 2000}ms fault refuse off\n" for t in range(3000, 40_000, 4000))
        _, faults = self.render_through("0s fault refuse on\n1500ms fault refuse off\n" + again, speed_cap=150_000)
        self.assertGreaterEqual(faults["links"][2]["up"]["half_closes"], 1)
        self.assertGreaterEqual(sum(link["refused"] for link in faults["links"]), 1)

    def test_black_hole(self):
        """Long enough that the servers count as dead; the client goes on alone, and they are welcome again afterwards."""
        stats, faults = self.render_through("1s fault black-hole on\n3.5s fault black-hole off\n")
        self.assertEqual(sum(link["cuts"] for link in faults["links"]), 0)
        self.assertGreaterEqual(stats["died"], 1)

    def test_flipped_bits(self):
        """About every sixth tile has one, and so have heads, headers and the frames of ZeroMQ itself, which then ends the connection.
        What is damaged is found by seals and hashes, dropped and rendered again."""
        stats, faults = self.render_through("300ms fault flip 1e-5\n")
        flips = sum(link[way]["flips"] for link in faults["links"] for way in ("up", "down"))
        self.assertGreaterEqual(flips, 5)
        self.assertGreaterEqual(stats["bad_messages"] + sum(link["connections"] for link in faults["links"]) - 6, 1, "nobody noticed")


class Tool(unittest.TestCase):
    """What the program itself promises: commands by standard input, sentences, exit codes, statistics."""

    def test_commands_signals_and_statistics(self):
        for ending in (signal.SIGTERM, signal.SIGINT):
            with tempfile.TemporaryDirectory() as folder, socket.create_server(("127.0.0.1", 0)) as target:
                port = target.getsockname()[1]
                chaos = Chaos(folder, f"{port},{port},{port}", "# nothing but words\n", "--seed", "5")
                first_port = int(chaos.ports.split(",")[0])
                with socket.create_connection(("127.0.0.1", first_port), timeout=PATIENCE_S) as dialler:
                    reached, _ = target.accept()
                    with reached:
                        self.disturb(chaos, dialler, reached)
                stats = chaos.finish(ending)
                self.assertEqual((stats["seed"], stats["commands"]), (5, 3))
                link = stats["links"][0]
                self.assertEqual((link["port"], link["target_port"]), (first_port, port))
                self.assertEqual((link["connections"], link["cuts"], link["resets"]), (1, 1, 0))
                self.assertEqual((link["up"]["bytes_in"], link["up"]["bytes_out"], link["up"]["flips"]), (1005, 1005, 1000))
                self.assertEqual(link["down"]["half_closes"], 1)
                self.assertEqual(stats["links"][1]["connections"], 0)

    def disturb(self, chaos, dialler, reached):
        words = chaos.process.stdin
        dialler.sendall(b"hello")
        self.assertEqual(reached.recv(5, socket.MSG_WAITALL), b"hello")
        words.write("\nfault flip 1 up\nfault half-close down li")
        words.flush()
        words.write("nk 1\n")
        words.flush()
        self.assertEqual(dialler.recv(1), b"")  # The second command has come, and so has the first.
        dialler.sendall(bytes(1000))
        received = reached.recv(1000, socket.MSG_WAITALL)
        self.assertTrue(all(byte.bit_count() == 1 for byte in received))
        words.write("fault cut")  # Without an end of line: the end of the input ends it.
        words.close()
        chaos.process.stdin = None
        with self.assertRaises(ConnectionResetError):
            reached.recv(1)

    def test_a_wrong_command_is_said_and_changes_nothing(self):
        process = subprocess.Popen([BIN / "pathscope-chaos", "--listen", "127.0.0.1:0", "--connect", "127.0.0.1:1"],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        process.stdout.readline()
        process.stdin.write("fault loss 10%\nfault cut link 2\n")
        process.stdin.flush()
        sentences = [process.stderr.readline() for _ in range(2)]
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
        self.assertEqual(process.returncode, 0)
        self.assertIn("'loss' is no fault", sentences[0])
        self.assertIn("There is no link 2", sentences[1])

    def test_bad_usage(self):
        with tempfile.TemporaryDirectory() as folder, socket.create_server(("127.0.0.1", 0)) as taken:
            schedule = pathlib.Path(folder) / "schedule"
            schedule.write_text("1s fault cut\nsoon fault cut\n")
            elsewhere = pathlib.Path(folder) / "elsewhere"
            elsewhere.write_text("\n1s fault cut link 2\n")
            busy = f"127.0.0.1:{taken.getsockname()[1]}"
            here, there = ["--listen", "127.0.0.1:0"], ["--connect", "127.0.0.1:1"]
            for arguments, words in (
                (here, "--connect"),
                (there, "--listen"),
                (["--listen", "6555", *there], "'6555'"),
                (["--listen", "127.0.0.1:65536", *there], "65536"),
                (["--listen", "127.0.0.1:1,", *there], "--listen"),
                ([*here, "--connect", "127.0.0.1:0"], "--connect"),
                (["--listen", "127.0.0.1:0,0", *there], "2 ports"),
                (["--listen", "0.0.0.0:0", *there], "--insecure"),
                (["--listen", busy, *there], busy.rpartition(":")[2]),
                ([*here, "--connect", "no.such.host.invalid:1"], "no.such.host.invalid"),
                ([*here, *there, "--seed", "x"], "--seed"),
                ([*here, *there, "--schedule", "no/such/file"], "no/such/file"),
                ([*here, *there, "--schedule", schedule], f"{schedule}: line 2: 'soon'"),
                ([*here, *there, "--schedule", elsewhere], f"{elsewhere}: line 2: There is no link 2"),
            ):
                with self.subTest(arguments=arguments):
                    result = subprocess.run([BIN / "pathscope-chaos", *arguments], stdin=subprocess.DEVNULL,
                                            capture_output=True, text=True, timeout=PATIENCE_S)
                    self.assertEqual(result.returncode, 2, result.stderr)
                    self.assertIn(words, result.stderr)
                    self.assertEqual(result.stdout, "")
                    self.assertEqual(result.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
