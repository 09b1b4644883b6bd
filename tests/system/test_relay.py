"""Relays as real processes: whoever stands between servers and client, and whoever of them dies or leaves, the image has the
same bits as the render without servers, and every round counts once. And what relays are for: a thousand servers behind four
of them bring the client a fraction of the tiles.

    test_relay.py BIN      BIN: the folder of the programs
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
JOB = ["--size", "200x150", "--spp", "128", "--direct-spp", "4", "--seed", "7"]
PATIENCE_S = 300  # A run that takes longer has failed.


def wait_until(what, condition, patience_s=PATIENCE_S):
    limit = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > limit:
            raise AssertionError("waited too long until " + what)
        time.sleep(0.01)


class Cluster:
    """A client that waits for servers, and everything that is started for it."""

    def __init__(self, folder, *options, job=JOB):
        self.folder = pathlib.Path(folder)
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(folder))
        self.ports = free_ports()
        self.stats_file = self.folder / "stats.json"
        self.stats_file.unlink(missing_ok=True)
        self.processes = []
        self.client = self.start("pathscope-render", SCENE, "-o", self.folder / "image.pfm", "--stats", self.stats_file, "--listen",
                                 "127.0.0.1", "--ports", self.ports, *job, *options, stderr=subprocess.PIPE, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.communicate()

    def start(self, program, *arguments, **how):
        self.processes.append(subprocess.Popen([BIN / program, *arguments], env=self.environment, **how))
        return self.processes[-1]

    def relay(self, name, ports=None):
        """The process, and the ports where it listens."""
        own = free_ports()
        return self.start("pathscope-relay", "--ports", ports or self.ports, "--listen-ports", own, "--name", name, "--quiet"), own

    def server(self, ports, name):
        return self.start("pathscope-server", "--ports", ports, "--name", name, "--threads", "1", "--quiet")

    def wait_until_busy(self, *servers):
        wait_until("the servers were at work", lambda: self.client.poll() is not None or all(cpu_seconds(s.pid) > 0.4 for s in servers))
        if self.client.poll() is not None:
            raise AssertionError("the client was done before: " + self.client.communicate()[1])

    def finish(self):
        self.said = self.client.communicate(timeout=PATIENCE_S)[1]
        if self.client.returncode != 0:
            raise AssertionError(f"exit code {self.client.returncode}: {self.said}")
        return json.loads(self.stats_file.read_text())


class Relays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = cls.temporary.name
        stats = pathlib.Path(cls.folder) / "alone.json"
        subprocess.run([BIN / "pathscope-render", SCENE, "-o", pathlib.Path(cls.folder) / "alone.pfm", "--stats", stats, *JOB],
                       check=True, capture_output=True)
        cls.expected = json.loads(stats.read_text())["image_hash"]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def check(self, stats, died=0, late=0):
        """late: messages that may come after their sender has left."""
        self.assertEqual(stats["image_hash"], self.expected)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        self.assertLessEqual(stats["bad_messages"], late)
        self.assertEqual(stats["died"], died)

    def samples(self, stats):
        return {server["name"]: server["samples"] for server in stats["servers"]}

    def pair_of_relays(self, cluster):
        """Two relays with two servers each."""
        relays, servers = [], []
        for name in ("left", "right"):
            relay, ports = cluster.relay(name)
            relays.append(relay)
            servers.append([cluster.server(ports, f"{name}-{i}") for i in range(2)])
        return relays, servers

    def test_two_relays_with_two_servers_each(self):
        with Cluster(self.folder, "--round", "16", "--min-servers", "2") as cluster:
            self.pair_of_relays(cluster)
            stats = cluster.finish()
            self.check(stats)
            self.assertEqual(set(self.samples(stats)), {"left", "right"})
            for name in ("left", "right"):
                self.assertGreater(self.samples(stats)[name], 0)

    def test_adaptive_rounds_and_audits(self):
        """The bits of an adaptive frame depend on the rounds, so the one that it must equal has the same."""
        options = ["--round", "16", "--adaptive", "on"]
        job = ["--size", "200x150", "--spp", "128", "--direct-spp", "32"]
        with Cluster(self.folder, *options, "--min-servers", "2", "--audit", "0.2", job=job) as cluster:
            self.pair_of_relays(cluster)
            relayed = cluster.finish()
        with Cluster(self.folder, *options, job=job) as cluster:
            cluster.server(cluster.ports, "server")
            self.assertEqual(relayed["image_hash"], cluster.finish()["image_hash"])
        self.assertGreater(relayed["rounds_audited"], 0)
        self.assertEqual(relayed["audits_differing"], 0)

    def test_a_relay_of_relays(self):
        with Cluster(self.folder, "--round", "32") as cluster:
            _, top = cluster.relay("top")
            _, low = cluster.relay("low", top)
            cluster.server(top, "near")
            cluster.server(low, "far")
            stats = cluster.finish()
            self.check(stats)
            self.assertEqual(set(self.samples(stats)), {"top"})

    def test_kill_9_of_a_relay(self):
        with Cluster(self.folder, "--round", "16", "--min-servers", "2") as cluster:
            relays, servers = self.pair_of_relays(cluster)
            cluster.wait_until_busy(*servers[0], *servers[1])
            relays[0].kill()
            self.check(cluster.finish(), died=1)
            self.assertTrue(all(server.poll() is None for server in servers[0]))  # They wait for another.

    def test_kill_9_of_a_server_behind_a_relay(self):
        with Cluster(self.folder, "--round", "16", "--min-servers", "2") as cluster:
            _, servers = self.pair_of_relays(cluster)
            cluster.wait_until_busy(*servers[0], *servers[1])
            servers[0][0].kill()
            self.check(cluster.finish())

    def test_a_relay_without_servers_is_none(self):
        """Its only server dies; the client goes on alone, and the relay comes back with the next server."""
        with Cluster(self.folder, "--round", "16") as cluster:
            _, ports = cluster.relay("relay")
            server = cluster.server(ports, "first")
            cluster.wait_until_busy(server)
            server.kill()
            cluster.server(ports, "second")
            stats = cluster.finish()
            self.check(stats, late=64)
            self.assertIn("relay left: No server is left.", cluster.said)

    def test_a_relay_is_drained(self):
        with Cluster(self.folder, "--round", "16", "--min-servers", "2") as cluster:
            relays, servers = self.pair_of_relays(cluster)
            cluster.wait_until_busy(*servers[0], *servers[1])
            relays[0].send_signal(signal.SIGTERM)
            self.assertEqual(relays[0].wait(timeout=PATIENCE_S), 0)
            self.check(cluster.finish())
            self.assertIn("left left: ", cluster.said)
            self.assertTrue(all(server.poll() is None for server in servers[0]))

    def test_keys_on_both_sides(self):
        def keygen(program, name):
            path = pathlib.Path(self.folder) / name
            public = subprocess.run([BIN / program, "--keygen", path], check=True, capture_output=True, text=True).stdout
            return path, public
        client, client_public = keygen("pathscope-render", "client.key")
        relay, relay_public = keygen("pathscope-relay", "relay.key")
        server, server_public = keygen("pathscope-server", "server.key")
        at_client, at_relay = (pathlib.Path(self.folder) / name for name in ("client.allow", "relay.allow"))
        at_client.write_text(relay_public)
        at_relay.write_text(server_public)
        with Cluster(self.folder, "--round", "16", "--key", client, "--allow", at_client) as cluster:
            ports = free_ports()
            cluster.start("pathscope-relay", "--ports", cluster.ports, "--listen-ports", ports, "--name", "relay", "--quiet", "--key", relay,
                          "--server-key", client_public.strip(), "--allow", at_relay)
            cluster.start("pathscope-server", "--ports", ports, "--quiet", "--key", server, "--server-key", relay_public.strip())
            self.check(cluster.finish())

    def test_bad_usage_is_told_in_a_sentence(self):
        for arguments, word in ((["--listen", "0.0.0.0"], "--insecure"), (["--key", "nowhere"], "--server-key"),
                                (["--listen-ports", "1,2"], "--listen-ports"), (["--name", ""], "--name")):
            run = subprocess.run([BIN / "pathscope-relay", *arguments], capture_output=True, text=True, timeout=PATIENCE_S)
            self.assertEqual(run.returncode, 2, run.stderr)
            self.assertEqual(run.stderr.count("\n"), 1)
            self.assertIn(word, run.stderr)

    def ghosts(self, relays, ghosts, round_samples):
        """With the patient detector: a thousand in one process may be silent for a second where others want the processor, too."""
        job = ["--size", "640x352", "--spp", "64", "--direct-spp", "1", "--audit", "0", "--round", str(round_samples), "--detector", "fixed"]
        with Cluster(self.folder, "--min-servers", str(relays or ghosts), job=job) as cluster:
            places = [cluster.relay(f"relay-{i}")[1] for i in range(relays)] or [cluster.ports]
            for ports in places:
                cluster.start("pathscope-server", "--ports", ports, "--ghost", str(ghosts // len(places)), "--ghost-speed", "5000", "--quiet")
            stats = cluster.finish()
        self.assertEqual(stats["samples"], 640 * 352 * 65)
        self.assertEqual(stats["died"], 0)
        return stats

    def test_a_thousand_ghosts_behind_four_relays(self):
        direct, relayed = self.ghosts(0, 1000, 4), self.ghosts(4, 1000, 64)
        for what, stats in (("1,000 ghosts", direct), ("4 relays of 250 ghosts", relayed)):
            print(f"{what}: {stats['servers_joined']} joined, {stats['tiles']} tiles, {stats['bytes_in']} bytes in, {stats['wall_s']:.2f} s")
        self.assertEqual(direct["servers_joined"], 1000)
        self.assertEqual(relayed["servers_joined"], 4)
        self.assertLessEqual(4 * relayed["tiles"], direct["tiles"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
