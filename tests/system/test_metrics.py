"""The page of metrics of a real run: it is asked while servers render, read by Prometheus' own Python parser, and must agree with --stats.

    test_metrics.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request

from prometheus_client.parser import text_string_to_metric_families

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SCENE = "scenes/cornell/scene.json"
PATIENCE_S = 60  # What takes longer has failed.
NAME = re.compile(r"pathscope_[a-z]+(_[a-z]+)*")


def read_page(url):
    """Metric name -> {labels: value}, by the strict reading of what a line may be."""
    with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer:
        assert answer.headers["Content-Type"].startswith("text/plain"), answer.headers["Content-Type"]
        text = answer.read().decode()
    page = {}
    for line in text.splitlines():
        assert re.fullmatch(r"# (HELP|TYPE) \S+ .+|[a-z_]+(\{.*\})? ([-+.0-9e]+|Nan)", line), line
    for family in text_string_to_metric_families(text):
        if family.name.startswith("exposer_"):
            continue  # What the library says of itself.
        assert family.type in ("counter", "gauge", "summary") and family.documentation, family
        for sample in family.samples:
            assert NAME.fullmatch(sample.name), sample
            assert (family.type == "counter") == sample.name.endswith("_total"), sample
            labels = tuple(sorted(sample.labels.items()))
            assert labels not in page.setdefault(sample.name, {}), f"{sample} is there twice"
            page[sample.name][labels] = sample.value
    return page


class Metrics(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.log = self.folder / "log"

    def start(self, *options):
        with open(self.log, "w") as log:
            client = subprocess.Popen([BIN / "pathscope-render", SCENE, "-o", self.folder / "a.pfm", "--stats",
                                       self.folder / "stats.json", "--size", "160x120", *options],
                                      env=dict(os.environ, XDG_CACHE_HOME=str(self.folder)), stderr=log)
        self.addCleanup(client.wait)
        self.addCleanup(client.kill)
        return client

    def url(self, client):
        limit = time.monotonic() + PATIENCE_S
        while time.monotonic() < limit and client.poll() is None:
            if found := re.search(r"http://\S+/metrics", self.log.read_text()):
                return found.group(0)
            time.sleep(0.01)
        self.fail(self.log.read_text())

    def test_a_run_with_servers(self):
        client = self.start("--seconds", "4", "--servers", "2", "--metrics", "127.0.0.1:0")
        url = self.url(client)
        pages = []
        while client.poll() is None:
            try:
                pages.append(read_page(url))
            except (urllib.error.URLError, ConnectionError):
                break  # The frame is finished.
            time.sleep(0.1)
        self.assertEqual(client.wait(PATIENCE_S), 0, self.log.read_text())
        stats = json.loads((self.folder / "stats.json").read_text())

        for before, after in zip(pages, pages[1:]):
            for name, values in before.items():
                if name.endswith("_total"):
                    self.assertGreaterEqual(after[name][()], values[()], name)
        last = pages[-1]
        for name in stats:  # Every counter is on the page, and no page is ahead of the end.
            if f"pathscope_{name}_total" in last:
                self.assertLessEqual(last[f"pathscope_{name}_total"][()], stats[name], name)
        self.assertGreater(last["pathscope_bytes_in_total"][()], 0)
        for rate in "rays", "samples", "tiles":
            self.assertGreater(last[f"pathscope_{rate}_per_second"][()], 0)
        self.assertEqual(last["pathscope_servers"][(("state", "ready"),)], 2)
        self.assertEqual(last["pathscope_died_total"][()], 0)
        self.assertGreater(last["pathscope_speed_samples_per_second"][()], 0)
        queue = [page["pathscope_queue_seconds"][()] for page in pages if "pathscope_queue_seconds" in page]
        self.assertTrue(queue and all(0 <= seconds <= 4 for seconds in queue), queue)  # --seconds 4
        rtts = {dict(labels)["name"]: value for labels, value in last["pathscope_heartbeat_seconds"].items()
                if dict(labels)["quantile"] == "0.5"}
        self.assertEqual(set(rtts), {"server-1", "server-2"})
        self.assertTrue(all(0 < rtt < 1 for rtt in rtts.values()), rtts)

    def test_strangers(self):
        client = self.start("--seconds", "3", "--metrics", "127.0.0.1:0")
        url = self.url(client)
        with self.assertRaises(urllib.error.HTTPError) as elsewhere:
            urllib.request.urlopen(url.replace("/metrics", "/etc/passwd"), timeout=PATIENCE_S)
        self.assertEqual(elsewhere.exception.code, 404)
        read_page(url)
        self.assertEqual(client.wait(PATIENCE_S), 0)

    def test_refusals(self):
        for address, words in (("0.0.0.0:0", "--metrics-public"), ("nonsense", "--metrics"), ("127.0.0.1:99999", "127.0.0.1:99999")):
            with self.subTest(address=address):
                client = self.start("--spp", "1", "--metrics", address)
                self.assertEqual(client.wait(PATIENCE_S), 2)
                self.assertIn(words, self.log.read_text())
                self.assertEqual(self.log.read_text().count("\n"), 1)
        client = self.start("--spp", "1", "--metrics", "0.0.0.0:0", "--metrics-public")
        self.assertEqual(client.wait(PATIENCE_S), 0, self.log.read_text())


if __name__ == "__main__":
    unittest.main()
