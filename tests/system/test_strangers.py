"""Strangers at every port, while a frame is rendered: a client with its page of metrics, a relay before it, servers at both. Garbage, an HTTP
request, hundreds of connections that say one byte now and then; frames of ZeroMQ that claim impossible sizes; and a peer that joins as it should
and answers with bombs and lies about sizes. Whatever they do, servers get in, the picture has its bits, each round counts once, and nobody grows.

    test_strangers.py BIN      BIN: the folder of pathscope-render, pathscope-server and pathscope-relay
"""
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

from processes import free_ports, wait_for

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
JOB = ["--size", "96x64", "--spp", "64", "--direct-spp", "4", "--seed", "7"]
SPEED_CAP = 60_000  # Samples per second of a server: the frame lasts for some seconds, on any machine.
LINES = 40  # Of a slow-loris, at each port.
PATIENCE_S = 30  # What takes longer has failed.
MOST_GROWTH_KIB = 100 * 1024

GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(16) + b"\x00" + bytes(31)  # ZMTP 3.0, RFC 23
READY = {kind: b"\x04" + bytes([22 + len(kind)]) + b"\x05READY\x0bSocket-Type" + struct.pack(">I", len(kind)) + kind for kind in (b"SUB", b"DEALER")}
SIZES = 0, 1, 2**31, 2**32 - 1, 2**63 - 1


def dial(port):
    line = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
    line.settimeout(0.5)
    return line


def listen_to(line):
    """Until the other side hangs up, or has nothing to say for half a second. True if it hung up."""
    try:
        while line.recv(65536):
            pass
        return True
    except TimeoutError:
        return False
    except OSError:
        return True


def resident_kib(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text())[1])


class SlowLoris:
    """Many connections, each of which says the next byte of a greeting now and then, as long as anybody listens."""

    def __init__(self, ports, text):
        self.stopping = threading.Event()
        self.lines = [dial(port) for port in ports for _ in range(LINES)]
        self.text = text
        self.thread = threading.Thread(target=self.dribble)
        self.thread.start()

    def dribble(self):
        said = 0
        while not self.stopping.wait(0.1):
            for line in self.lines:
                try:
                    line.send(self.text[said % len(self.text):][:1])
                except OSError:
                    pass  # It was hung up.
            said += 1

    def end(self):
        self.stopping.set()
        self.thread.join()
        for line in self.lines:
            line.close()


def zstd_bomb(megabytes, claims):
    """RFC 8878: a frame that says it holds `claims` bytes; blocks of 128 KiB, each one byte again and again."""
    blocks = 8 * megabytes
    text = b"".join(struct.pack("<I", (i == blocks - 1) | 1 << 1 | (1 << 17) << 3)[:3] + b"\0" for i in range(blocks))
    return b"\x28\xb5\x2f\xfd\xa0" + struct.pack("<I", claims) + text


def lies_about(tile, honest_bytes):
    """Payload, codec and raw_bytes of answers none of which may be believed."""
    for size in 0, 1, 2**31, 2**32 - 1:
        yield tile, "raw", size
        yield zstd_bomb(1, size), "shuffle-zstd", honest_bytes
        yield zstd_bomb(1, size), "shuffle-zstd", size
    yield b"", "raw", honest_bytes
    yield b"\0", "raw", honest_bytes
    yield zstd_bomb(1024, 2**30), "shuffle-zstd", honest_bytes
    yield zstd_bomb(1024, honest_bytes), "shuffle-zstd", honest_bytes


def liar_program(folder):
    """tools/python-worker, which answers leases by lies, one after the other."""
    worker, last_lines = pathlib.Path("tools/python-worker").read_text().split("\nparser = ")
    test = pathlib.Path(__file__).read_text()
    bombs = test[test.index("def zstd_bomb"):test.index("class Strangers")].split("\ndef liar_program")[0]
    program = folder / "liar.py"
    program.touch(mode=0o755)
    program.write_text(worker + "\n\n" + bombs + """
class Liar(Worker):
    told = 0
    def on_lease(self, lease, _):
        tile = flat_tile(lease)
        lies = list(lies_about(tile, len(tile)))
        payload, codec, size = lies[self.told % len(lies)]
        self.told += 1
        same = {name: lease[name] for name in ("session", "lease", "epoch", "strategy", "unit", "first", "count")}
        self.send(self.frames, "TILE", payload, **same, codec=codec, raw_bytes=size, hash=hash_of(payload), rays=0, samples=1, started_ns=0,
                  render_ns=1, dropped=[], dropped_count=0, saturated_count=0)
Worker = Liar
parser = """ + last_lines)
    return program


class Strangers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.expected = {strategy: cls.hash_alone(strategy) for strategy in ("blocks", "flat")}

    @classmethod
    def hash_alone(cls, strategy):
        subprocess.run([BIN / "pathscope-render", SCENE, "-o", cls.folder / "alone.pfm", "--stats", cls.folder / "alone.json", *JOB,
                        "--strategy", strategy], env=dict(os.environ, XDG_CACHE_HOME=str(cls.folder)), check=True, capture_output=True,
                       timeout=PATIENCE_S)
        return json.loads((cls.folder / "alone.json").read_text())["image_hash"]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def setUp(self):
        """A client with metrics, a relay, and nobody else."""
        self.stats = self.folder / "stats.json"
        self.stats.unlink(missing_ok=True)
        self.client_ports, self.relay_ports = free_ports(), free_ports()

    def start(self, name, *arguments):
        log = self.folder / f"{name}-{time.monotonic_ns()}.log"
        with open(log, "w") as file:
            process = subprocess.Popen([BIN / name, *map(str, arguments)], env=dict(os.environ, XDG_CACHE_HOME=str(self.folder)),
                                       stderr=file, stdout=subprocess.DEVNULL)
        process.log = log
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def open_house(self, *options, strategy="blocks"):
        self.strategy = strategy
        self.client = self.start("pathscope-render", SCENE, "-o", self.folder / "image.pfm", "--stats", self.stats, *JOB, "--listen",
                                 "127.0.0.1", "--ports", self.client_ports, "--metrics", "127.0.0.1:0", "--audit", "0",
                                 "--strategy", strategy, *options)
        self.relay = self.start("pathscope-relay", "--ports", self.client_ports, "--listen-ports", self.relay_ports)
        self.url = wait_for(lambda: re.search(r"http://127.0.0.1:(\d+)/metrics", self.client.log.read_text()), "the page", PATIENCE_S)
        self.doors = [int(port) for ports in (self.client_ports, self.relay_ports) for port in ports.split(",")]
        for port in self.doors:
            wait_for(lambda port=port: self.is_open(port), f"port {port}", PATIENCE_S)  # Else a line to it is refused.
        self.begun = resident_kib(self.client.pid), resident_kib(self.relay.pid)

    @staticmethod
    def is_open(port):
        try:
            dial(port).close()
            return True
        except OSError:
            return False

    def server(self, ports, name):
        return self.start("pathscope-server", "--ports", ports, "--name", name, "--threads", "1", "--speed-cap", SPEED_CAP, "--quiet")

    def finish(self):
        """The client ends well and with the right picture, the relay when it is told to; neither has grown."""
        grown = [resident_kib(process.pid) - before for process, before in zip((self.client, self.relay), self.begun)]
        self.assertEqual(self.client.wait(PATIENCE_S), 0, self.client.log.read_text())
        self.assertIsNone(self.relay.poll(), self.relay.log.read_text())
        self.relay.send_signal(signal.SIGTERM)
        self.assertEqual(self.relay.wait(PATIENCE_S), 0, self.relay.log.read_text())
        for kib in grown:
            self.assertLess(kib, MOST_GROWTH_KIB)
        stats = json.loads(self.stats.read_text())
        self.assertEqual(stats["image_hash"], self.expected[self.strategy])
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        return stats

    def work(self):
        """One server behind the relay, one at the client's own door."""
        self.server(self.relay_ports, "behind")
        self.server(self.client_ports, "beside")

    def test_garbage_and_http(self):
        self.open_house("--min-servers", "2")
        texts = [b"GET / HTTP/1.1\r\nHost: a\r\n\r\n", os.urandom(4096), b"\0" * 4096, b"\xff" * 4096, GREETING[:20], GREETING + os.urandom(4096)]
        for port in self.doors + [int(self.url[1])]:
            for text in texts:
                with dial(port) as line:
                    line.settimeout(0.1)
                    try:
                        line.sendall(text)
                    except OSError:
                        pass
                    listen_to(line)
        self.work()
        stats = self.finish()
        self.assertGreaterEqual(stats["refused_peers"], 6)

    def test_a_slow_loris_keeps_nobody_out(self):
        """Neither servers that come while hundreds of lines are open, nor who asks for the metrics, but for a while."""
        self.open_house("--min-servers", "2")
        loris = [SlowLoris(self.doors, GREETING), SlowLoris([int(self.url[1])], b"GET /metrics HTTP/1.1\r\nX: " + b"x" * 4000)]
        try:
            with urllib.request.urlopen(self.url[0], timeout=PATIENCE_S) as answer:
                self.assertIn("pathscope_samples_left", answer.read().decode())
            self.work()
            stats = self.finish()
        finally:
            for one in loris:
                one.end()
        self.assertEqual(stats["servers_joined"], 2)

    def test_sizes_that_frames_of_zeromq_claim(self):
        """A line that said all that is right, and then that so many bytes follow: the large ones are hung up on before a byte of them is there."""
        self.open_house("--min-servers", "2")
        for port, kind in zip(self.doors, [b"SUB", b"DEALER", b"DEALER"] * 2):
            for size in SIZES:
                with dial(port) as line:
                    line.sendall(GREETING)
                    line.settimeout(PATIENCE_S)
                    heard = b""
                    while len(heard) < len(GREETING):
                        heard += line.recv(len(GREETING) - len(heard)) or self.fail(f"port {port} hangs up on a right greeting")
                    line.sendall(READY[kind] + b"\x02" + struct.pack(">Q", size))
                    line.settimeout(1)
                    self.assertEqual(listen_to(line), size > 1, f"port {port}, size {size}")
        self.work()
        self.finish()

    def test_a_peer_that_answers_with_bombs(self):
        """What it sends is refused before it is unpacked, and it is shut out for a while."""
        self.open_house("--min-servers", "2", strategy="flat")
        liar = subprocess.Popen([liar_program(self.folder), "--ports", self.client_ports, "--name", "liar"])
        self.addCleanup(liar.wait)
        self.addCleanup(liar.kill)
        self.server(self.relay_ports, "behind")
        wait_for(lambda: "liar is banned" in self.client.log.read_text(), "a ban", PATIENCE_S)
        self.server(self.client_ports, "beside")
        stats = self.finish()
        self.assertGreaterEqual(stats["banned"], 1)


if __name__ == "__main__":
    unittest.main()
