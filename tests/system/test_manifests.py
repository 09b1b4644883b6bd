"""The manifests of tools/cluster without a cluster: each fits its schema (manifest_schemas.py), refers only to what is there, and tells the
programs only what they understand. That the schemas refuse is tested as well.

    test_manifests.py BIN      BIN: the folder of pathscope-render and pathscope-server
"""
import copy
import pathlib
import re
import subprocess
import sys
import unittest

import jsonschema
import yaml

from manifest_schemas import COMPOSE, KINDS

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
CLUSTER = pathlib.Path("tools/cluster")
PORTS = {"input": 5555, "monitor": 5556, "frames": 5557, "metrics": 9464}
# Of sbatch(1).
SBATCH_OPTIONS = {"job-name", "array", "ntasks", "cpus-per-task", "requeue", "open-mode", "signal"}


class UniqueKeys(yaml.SafeLoader):
    """YAML forbids a key that is there twice; its reader does not."""

    def construct_mapping(self, node, deep=False):
        keys = [self.construct_object(key, deep=deep) for key, _ in node.value]
        assert len(keys) == len(set(keys)), f"{node.start_mark}: a key is there twice"
        return super().construct_mapping(node, deep)


def read(path):
    with open(path) as file:
        return list(yaml.load_all(file, UniqueKeys))


def flags(program):
    return set(re.findall(r"--[a-z][a-z-]*", subprocess.run([BIN / program, "--help"], capture_output=True, text=True).stdout)) | {"-o"}


def kubernetes():
    found = {}
    for path in sorted((CLUSTER / "kubernetes").glob("*.yaml")):
        for manifest in read(path):
            found[manifest["kind"]] = manifest
    return found


def every_field(value, path=()):
    """The paths to all maps in a manifest."""
    if isinstance(value, dict):
        yield path
        for key, part in value.items():
            yield from every_field(part, (*path, key))
    elif isinstance(value, list):
        for number, part in enumerate(value):
            yield from every_field(part, (*path, number))


FREE = {"labels", "matchLabels", "selector", "annotations", "services", "secrets", "configs"}  # Maps with keys of our choice.


class Schemas(unittest.TestCase):
    def check(self, manifest, schema):
        jsonschema.Draft202012Validator.check_schema(schema)
        jsonschema.validate(manifest, schema, jsonschema.Draft202012Validator)
        for path in every_field(manifest):  # A field that nobody knows is refused wherever it stands.
            if path and path[-1] in FREE:
                continue
            wrong = copy.deepcopy(manifest)
            part = wrong
            for step in path:
                part = part[step]
            part["noSuchField"] = "x"
            with self.subTest(path=path), self.assertRaises(jsonschema.ValidationError):
                jsonschema.validate(wrong, schema, jsonschema.Draft202012Validator)

    def test_kubernetes(self):
        manifests = kubernetes()
        self.assertEqual(set(manifests), set(KINDS))
        for kind, manifest in manifests.items():
            with self.subTest(kind=kind):
                self.check(manifest, KINDS[kind])

    def test_compose(self):
        (manifest,) = read(CLUSTER / "compose/compose.yaml")
        self.check(manifest, COMPOSE)

    def test_values_of_a_wrong_kind_are_refused(self):
        service = kubernetes()["Service"]
        for change in ({"port": "5555"}, {"port": 0}, {"port": 65536}, {"name": "Input"}, {"targetPort": 5555}):
            wrong = copy.deepcopy(service)
            wrong["spec"]["ports"][0].update(change)
            with self.subTest(change=change), self.assertRaises(jsonschema.ValidationError):
                jsonschema.validate(wrong, KINDS["Service"])


class Meaning(unittest.TestCase):
    """What a schema cannot see."""

    def pods(self):
        manifests = kubernetes()
        for kind in "Job", "Deployment":
            yield kind, manifests[kind]["spec"]["template"]

    def check_arguments(self, program, arguments):
        known = flags(program)
        for word in arguments:
            self.assertTrue(not word.startswith("-") or word in known, f"{program} has no {word}")

    def test_programs_get_flags_that_they_have(self):
        for _, pod in self.pods():
            for container in pod["spec"]["containers"]:
                self.check_arguments(container["command"][0], container["args"])
        services = read(CLUSTER / "compose/compose.yaml")[0]["services"]
        self.check_arguments("pathscope-render", services["client"]["command"])
        self.check_arguments("pathscope-server", services["server"]["command"])

    def test_names_lead_somewhere(self):
        manifests = kubernetes()
        secrets = {secret["name"]: secret["files"] for secret in manifests["Kustomization"]["secretGenerator"]}
        files = {path.name for path in (CLUSTER / "kubernetes").glob("*.yaml")} - {"kustomization.yaml"}
        self.assertEqual(set(manifests["Kustomization"]["resources"]), files)
        for kind, pod in self.pods():
            volumes = {volume["name"]: volume for volume in pod["spec"]["volumes"]}
            for container in pod["spec"]["initContainers"] + pod["spec"]["containers"]:
                self.assertLessEqual({mount["name"] for mount in container["volumeMounts"]}, set(volumes))
            secret = secrets[volumes["secret"]["secret"]["secretName"]]
            copied = {word.removeprefix("/secret/") for word in pod["spec"]["initContainers"][0]["command"] if "/secret/" in word}
            self.assertEqual(copied, {file.removeprefix("keys/") for file in secret})
            used = {word for word in pod["spec"]["containers"][0]["args"] if word.startswith("/keys/")}
            self.assertEqual(used, {f"/keys/{file}" for file in copied})
        claim = manifests["PersistentVolumeClaim"]["metadata"]["name"]
        self.assertIn({"name": "work", "persistentVolumeClaim": {"claimName": claim}}, manifests["Job"]["spec"]["template"]["spec"]["volumes"])

    def test_servers_find_the_client(self):
        manifests = kubernetes()
        service, client, servers = manifests["Service"], manifests["Job"]["spec"]["template"], manifests["Deployment"]["spec"]
        self.assertLessEqual(service["spec"]["selector"].items(), client["metadata"]["labels"].items())
        self.assertFalse(service["spec"]["selector"].items() <= servers["template"]["metadata"]["labels"].items())
        self.assertEqual(servers["selector"]["matchLabels"], servers["template"]["metadata"]["labels"])
        self.assertEqual({port["name"]: port["port"] for port in service["spec"]["ports"]}, PORTS)
        self.assertEqual({port["name"]: port["containerPort"] for port in client["spec"]["containers"][0]["ports"]}, PORTS)
        arguments = servers["template"]["spec"]["containers"][0]["args"]
        self.assertEqual(arguments[arguments.index("--connect") + 1], service["metadata"]["name"])

    def test_the_autoscaler_steers_the_servers_by_a_metric_that_there_is(self):
        manifests = kubernetes()
        spec = manifests["HorizontalPodAutoscaler"]["spec"]
        self.assertEqual(spec["scaleTargetRef"]["name"], manifests["Deployment"]["metadata"]["name"])
        self.assertNotIn("replicas", manifests["Deployment"]["spec"])  # Each `apply` would set it back.
        metric = spec["metrics"][0]["external"]["metric"]["name"].removeprefix("pathscope_")
        self.assertIn(f'gauge("{metric}"', pathlib.Path("src/metrics/exposition.cpp").read_text())

    def test_compose_shares_what_it_has(self):
        (compose,) = read(CLUSTER / "compose/compose.yaml")
        for service in compose["services"].values():
            given = {secret["source"]: secret["target"] for secret in service.get("secrets", [])}
            self.assertLessEqual(set(given), set(compose["secrets"]))
            used = {word.removeprefix("/run/secrets/") for word in service.get("command", []) if word.startswith("/run/secrets/")}
            self.assertEqual(used, set(given.values()))
        self.assertEqual({int(port) for port in compose["services"]["client"]["expose"]}, set(PORTS.values()))
        scrape = yaml.safe_load(compose["configs"]["prometheus"]["content"])["scrape_configs"][0]
        self.assertEqual(scrape["static_configs"], [{"targets": [f"client:{PORTS['metrics']}"]}])

    def test_batch_scripts(self):
        for script in sorted((CLUSTER / "slurm").glob("*.sbatch")):
            with self.subTest(script=script.name):
                subprocess.run(["bash", "-n", script], check=True)
                text = script.read_text()
                options = re.findall(r"^#SBATCH --([a-z-]+)", text, re.MULTILINE)
                self.assertEqual(len(options), text.count("#SBATCH"))
                self.assertLessEqual(set(options), SBATCH_OPTIONS)
                self.assertLessEqual({"requeue", "signal"}, set(options))
                command = text[text.index("exec "):]
                program = re.search(r"pathscope-[a-z]+", command).group(0)
                self.check_arguments(program, re.findall(r"--[a-z][a-z-]*", command))


if __name__ == "__main__":
    unittest.main()
