"""Who may come in, with real processes: right keys give the image that no keys give; wrong, unknown, missing and revoked
keys are refused, nothing of theirs is read, and both sides say why; strangers at the ports change nothing.

    test_security.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import signal
import socket
import stat
import subprocess
import sys
import tempfile
import time
import unittest

from processes import cpu_seconds, free_ports, wait_for

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
JOB = ["--size", "96x64", "--spp", "64", "--direct-spp", "4", "--seed", "7"]
PATIENCE_S = 120  # What takes longer has failed.


class Program:
    """A process whose standard error can be read while it runs."""

    def __init__(self, folder, name, *arguments):
        self.log = pathlib.Path(folder) / f"{name}-{time.monotonic_ns()}.log"
        environment = dict(os.environ, XDG_CACHE_HOME=str(folder), TMPDIR=str(folder))
        with open(self.log, "w") as log:
            self.process = subprocess.Popen([BIN / name, *map(str, arguments)], env=environment, stderr=log,
                                            stdout=subprocess.DEVNULL)

    def text(self):
        return self.log.read_text()

    def says(self, *parts):
        """One of them."""
        def said():
            return any(part in self.text() for part in parts)
        wait_for(lambda: said() or self.process.poll() is not None, f"'{parts}'", PATIENCE_S)
        return said()

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        self.process.wait(PATIENCE_S)


class Security(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.public = {name: cls.keygen(name) for name in ("client", "good", "other")}
        cls.expected = cls.finish(cls, cls.render(cls, keys=False))["image_hash"]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def keygen(cls, name, program="pathscope-server"):
        done = subprocess.run([BIN / program, "--keygen", cls.folder / name], capture_output=True, text=True)
        if done.returncode != 0:
            raise AssertionError(done.stderr)
        return done.stdout.strip()

    def setUp(self):
        self.running = []
        self.ports = free_ports()
        self.allow = self.folder / f"allow-{time.monotonic_ns()}"
        self.allow.write_text((self.folder / "good.pub").read_text())

    def tearDown(self):
        for program in self.running:
            program.stop()

    # ---- The programs.

    def render(self, *options, keys=True):
        self.stats = self.folder / "stats.json"
        self.stats.unlink(missing_ok=True)
        if keys:
            options = ["--key", self.folder / "client", *options]
        return Program(self.folder, "pathscope-render", SCENE, "-o", self.folder / "image.pfm", "--stats", self.stats,
                       *JOB, *options)

    def listen(self, *options, keys=True):
        """A client that waits until a server comes."""
        options = ["--listen", "127.0.0.1", "--ports", self.ports, *options]
        if keys:
            options += ["--allow", self.allow]
        client = self.render(*options, keys=keys)
        self.running.append(client)
        return client

    def server(self, key=None, client="client", *options):
        if key:
            options += ("--key", self.folder / key, "--server-key", self.folder / f"{client}.pub")
        server = Program(self.folder, "pathscope-server", "--ports", self.ports, "--threads", "1",
                         "--name", key or "plain", *options)
        self.running.append(server)
        return server

    def finish(self, client):
        client.process.wait(PATIENCE_S)
        if client.process.returncode != 0:
            raise AssertionError(client.text())
        return json.loads(self.stats.read_text())

    def check(self, stats, joined=1):
        self.assertEqual(stats["image_hash"], self.expected)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        self.assertEqual(stats["servers_joined"], joined)

    # ---- Right keys.

    def test_local_servers_get_throw_away_keys(self):
        client = self.render("--servers", "2")
        self.running.append(client)
        folders = lambda: list(self.folder.glob("pathscope-keys-*"))
        wait_for(lambda: len(list(self.folder.glob("pathscope-keys-*/*.key"))) == 2 or client.process.poll() is not None,
                 "the keys of local servers", PATIENCE_S)
        for key in self.folder.glob("pathscope-keys-*/*.key"):
            self.assertEqual(stat.S_IMODE(key.stat().st_mode), 0o600)
            self.assertEqual(stat.S_IMODE(key.parent.stat().st_mode), 0o700)
        stats = self.finish(client)
        self.check(stats, joined=2)
        self.assertEqual(stats["refused_peers"], 0)
        self.assertEqual(folders(), [])

    def test_a_listed_server_gives_the_same_image(self):
        client = self.listen()
        self.server("good")
        stats = self.finish(client)
        self.check(stats)
        self.assertEqual((stats["refused_peers"], stats["bad_messages"]), (0, 0))
        self.assertGreater(stats["servers"][0]["samples"], 0)

    # ---- Wrong ones. The client waits for a server; a right one is started when both sides have said why.

    def refuse(self, server, at_server, at_client, client=None, joined=1, last=None):
        client = client or self.listen()
        self.assertTrue(client.says("Waiting for servers"), client.text())
        refused = server()
        self.assertTrue(refused.says(*at_server), refused.text() + client.text())
        self.assertTrue(client.says(at_client), client.text())
        self.assertIsNone(refused.process.poll(), "a refused server goes on trying")
        (last or (lambda: self.server("good")))()
        stats = self.finish(client)
        self.check(stats, joined)
        self.assertGreater(stats["refused_peers"], 0)
        self.assertEqual(stats["bad_messages"], 0)  # Nothing of theirs was read.
        return refused

    def test_an_unknown_key(self):
        refused = self.refuse(lambda: self.server("other"), [self.public["other"]], self.public["other"])
        self.assertIn("--allow", refused.text())

    def test_a_wrong_server_key(self):
        self.refuse(lambda: self.server("good", "other"), ["--server-key is not its public key"], self.public["client"])

    def test_no_key(self):
        self.refuse(lambda: self.server(), ["it wants encryption", "it hung up"], "without encryption")

    def test_a_server_with_keys_at_a_client_without(self):
        # The client may notice first, and hang up before the server has read why.
        self.refuse(lambda: self.server("good"), ["it speaks without encryption", "started without --key"], "it wants encryption",
                    client=self.listen(keys=False), last=lambda: self.server())

    def test_a_refused_server_comes_in_when_it_is_listed(self):
        client = self.listen()
        late = self.server("other")
        self.assertTrue(late.says("does not know this server's key"))
        with open(self.allow, "a") as file:
            file.write((self.folder / "other.pub").read_text())
        self.check(self.finish(client))

    def test_a_key_that_is_revoked_while_its_server_works(self):
        with open(self.allow, "a") as file:
            file.write((self.folder / "other.pub").read_text())
        self.server("good", "client", "--speed-cap", "40000")
        revoked = self.server("other", "client", "--speed-cap", "40000")
        client = self.listen("--min-servers", "2")
        client.says("Waiting for servers")
        waiting = cpu_seconds(revoked.process.pid)
        wait_for(lambda: cpu_seconds(revoked.process.pid) > waiting + 0.05 or client.process.poll() is not None, "work", PATIENCE_S)
        self.assertIsNone(client.process.poll(), client.text())
        self.allow.write_text((self.folder / "good.pub").read_text())
        begin = time.monotonic()
        self.assertTrue(client.says("other is lost: Its key was taken off the list."), client.text())
        self.assertLess(time.monotonic() - begin, 5)
        self.assertTrue(revoked.says("does not know this server's key"), revoked.text())
        stats = self.finish(client)
        self.check(stats, joined=2)
        died = {server["name"]: server["died"] for server in stats["servers"]}
        self.assertEqual(died, {"good": False, "other": True})

    # ---- Strangers at the ports.

    def knock(self, client):
        garbage = [b"GET / HTTP/1.1\r\nHost: a\r\n\r\n", os.urandom(4096), b"\xff\x00\x00\x00\x00\x00\x00\x00\x01\x7f\x03\x00CURVE"]
        for port in map(int, self.ports.split(",")):
            for text in garbage:
                with socket.create_connection(("127.0.0.1", port)) as line:
                    line.sendall(text)
                    line.settimeout(0.2)
                    try:
                        while line.recv(4096):
                            pass
                    except OSError:
                        pass
        self.assertIsNone(client.process.poll(), client.text())

    def test_strangers_with_keys(self):
        client = self.listen()
        self.assertTrue(client.says("Waiting for servers"))
        self.knock(client)
        self.assertTrue(client.says("Refused a connection"), client.text())
        self.server("good")
        stats = self.finish(client)
        self.check(stats)
        self.assertGreaterEqual(stats["refused_peers"], 6)
        self.assertEqual(stats["bad_messages"], 0)

    def test_strangers_without_keys(self):
        client = self.listen(keys=False)
        self.assertTrue(client.says("Waiting for servers"))
        self.knock(client)
        self.server()
        stats = self.finish(client)
        self.check(stats)
        self.assertGreater(stats["refused_peers"] + stats["bad_messages"], 0)

    # ---- What is refused before anything begins.

    def refused_at_once(self, program, *arguments):
        words = {"pathscope-render": [SCENE, "-o", self.folder / "x.pfm", *JOB], "pathscope-server": []}[program]
        done = subprocess.run([BIN / program, *map(str, [*words, *arguments])], capture_output=True, text=True, timeout=PATIENCE_S)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        return done.stderr

    def test_keygen(self):
        for program in "pathscope-server", "pathscope-render":
            name = f"fresh-{program}"
            public = self.keygen(name, program)
            file = self.folder / name
            self.assertEqual(stat.S_IMODE(file.stat().st_mode), 0o600)
            self.assertEqual(len(public), 40)
            self.assertTrue((self.folder / f"{name}.pub").read_text().startswith(public))
            before = file.read_text()
            done = subprocess.run([BIN / program, "--keygen", file], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn("never overwritten", done.stderr)
            self.assertEqual(file.read_text(), before)

    def test_a_key_file_that_others_can_read(self):
        self.keygen("open")
        (self.folder / "open").chmod(0o644)
        self.assertIn("chmod 600", self.refused_at_once("pathscope-server", "--key", self.folder / "open", "--server-key",
                                                        self.public["client"]))
        self.assertIn("chmod 600", self.refused_at_once("pathscope-render", "--key", self.folder / "open", "--servers", "1"))

    def test_flags_that_need_each_other(self):
        self.assertIn("--server-key", self.refused_at_once("pathscope-server", "--key", self.folder / "good"))
        self.assertIn("--key", self.refused_at_once("pathscope-server", "--server-key", self.public["client"]))
        self.assertIn("neither", self.refused_at_once("pathscope-server", "--key", self.folder / "good", "--server-key", "none"))
        self.assertIn("--allow", self.refused_at_once("pathscope-render", "--key", self.folder / "client", "--listen", "127.0.0.1"))
        self.assertIn("--key", self.refused_at_once("pathscope-render", "--allow", self.allow, "--listen", "127.0.0.1"))
        bad = self.folder / "bad-list"
        bad.write_text("nonsense\n")
        self.assertIn("bad-list:1", self.refused_at_once("pathscope-render", "--key", self.folder / "client", "--listen",
                                                         "127.0.0.1", "--allow", bad))

    def test_an_address_that_others_can_reach(self):
        self.assertIn("--insecure", self.refused_at_once("pathscope-render", "--listen", "0.0.0.0"))
        ports = ["--ports", self.ports]
        for keys in False, True:
            options = ["--key", self.folder / "client", "--allow", self.allow] if keys else ["--insecure"]
            client = self.render("--listen", "0.0.0.0", "--min-servers", "0", *ports, *options, keys=False)
            self.running.append(client)
            self.check(self.finish(client), joined=0)
            self.assertEqual("Insecure" in client.text(), not keys)


if __name__ == "__main__":
    unittest.main()
