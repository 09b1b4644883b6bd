"""A server that lies: a real one of which one bit of one result in nine is false, beside an honest one. It is found and shut
out, and the image has the same bits as the render without servers.

    test_audit.py BIN LIAR      BIN: the folder of pathscope-render and pathscope-server; LIAR: the program lying-server
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from processes import free_ports

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
LIAR = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
WIDTH, HEIGHT, SPP, DIRECT_SPP = 160, 120, 16, 8
JOB = ["--size", f"{WIDTH}x{HEIGHT}", "--spp", str(SPP), "--direct-spp", str(DIRECT_SPP), "--seed", "7"]
PATIENCE_S = 300


class Audit(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.environment = dict(os.environ, XDG_CACHE_HOME=self.folder.name)

    def render(self, servers, *options):
        """The statistics, and what the client said."""
        stats = pathlib.Path(self.folder.name) / "stats.json"
        ports = free_ports()
        client = subprocess.Popen(
            [BIN / "pathscope-render", SCENE, "-o", pathlib.Path(self.folder.name) / "image.pfm", "--stats", stats, *JOB,
             *(["--listen", "127.0.0.1", "--ports", ports, "--min-servers", str(len(servers))] if servers else []),
             *options], env=self.environment, stderr=subprocess.PIPE, text=True)
        started = [
            subprocess.Popen([LIAR if program == LIAR.name else BIN / program, "--connect", "127.0.0.1", "--ports", ports,
                              "--threads", "1", "--name", f"{program}-{i}", "--quiet"], env=self.environment,
                             stderr=subprocess.DEVNULL) for i, program in enumerate(servers)]
        try:
            said = client.communicate(timeout=PATIENCE_S)[1]
        finally:
            for process in [client, *started]:
                process.kill()
                process.wait()
        self.assertEqual(client.returncode, 0, said)
        return json.loads(stats.read_text()), said

    def check_undone(self, servers, *options):
        honest, _ = self.render([], *options)
        stats, said = self.render(servers, "--audit", "1", *options)
        self.assertEqual(stats["image_hash"], honest["image_hash"])
        self.assertGreaterEqual(stats["audits_differing"], 1)
        self.assertGreaterEqual(stats["banned"], 1)
        self.assertEqual(stats["rounds"], stats["rounds_committed"])
        self.assertEqual(stats["samples"], honest["samples"])
        counted = stats["client"]["samples"] + sum(server["samples"] for server in stats["servers"])
        self.assertEqual(counted, stats["samples"])
        self.assertIn("lying-server-0 gave a false result", said)
        self.assertNotIn("pathscope-server-1 gave", said)
        print(f"{stats['rounds_audited']} audited, {stats['audits_differing']} differing, {stats['rounds_undone']} undone")

    def test_a_liar_is_found_by_the_other_and_by_the_client(self):
        self.check_undone(["lying-server", "pathscope-server"])

    def test_a_liar_that_is_alone_is_found_by_the_client(self):
        self.check_undone(["lying-server"])

    def test_adaptive_rounds_begin_anew(self):
        self.check_undone(["lying-server", "pathscope-server"], "--adaptive", "on")

    def test_honest_servers_pay_for_it_and_no_more(self):
        stats, _ = self.render(["pathscope-server", "pathscope-server"], "--audit", "1")
        self.assertEqual(stats["audits_differing"], 0)
        self.assertEqual(stats["banned"], 0)
        self.assertGreater(stats["rounds_audited"], 0)
        self.assertEqual(stats["samples"], WIDTH * HEIGHT * (SPP + DIRECT_SPP))


if __name__ == "__main__":
    unittest.main(verbosity=1)
