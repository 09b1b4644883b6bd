"""The simulation must be able to fail: bugs are put in on purpose, one at a time, and each must break a world.

    test_mutants.py BUILD      BUILD: a configured build folder with test_session in it

A mutant is one source file with a few words changed, compiled as the build compiles it and linked into test_session before
the library that holds the sound one. Within 100 seeds (a few more where said) some world must break. And a compiler that
rounds otherwise must show in the golden round.
"""
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

BUILD = pathlib.Path(sys.argv.pop(1)).resolve()
WORLDS = "whatever the network does*"
SEEDS = 100
PATIENCE_S = 600

LEDGER = "src/cluster/ledger.cpp"
SERVER = "src/session/server_machine.cpp"
SERVER_STATE = "src/session/server_state.cpp"
JOINING = "src/session/client_joining.cpp"


def ninja_commands(program):
    text = subprocess.run(["ninja", "-C", BUILD, "-t", "commands", program], check=True,
                          capture_output=True, text=True).stdout
    return text.splitlines()


def compile_command(commands, source, mutant, out):
    line = next(line for line in commands if line.endswith(f" -c {pathlib.Path(source).resolve()}"))
    words = shlex.split(line)
    del words[words.index("-MD"):words.index("-o")]  # No dependency file.
    words[words.index("-o") + 1] = str(out)
    words[-1] = str(mutant)
    return [*words, f"-I{pathlib.Path(source).resolve().parent}"]


def link_command(commands, extra, out, program="test_session"):
    line = next(line for line in reversed(commands) if f" -o {program} " in line)
    words = shlex.split(re.sub(r"^: && | && :$", "", line))
    words[words.index("-o") + 1] = str(out)
    first_object = next(i for i, word in enumerate(words) if word.endswith(".o"))
    return [*words[:first_object], str(extra), *words[first_object:]]


def broken_worlds(program, seeds):
    """How many of the worlds broke. A program that stops at a CHECK of its own has noticed as well."""
    environment = dict(os.environ, PATHSCOPE_SEEDS=str(seeds))
    run = subprocess.run([program, "-tc=" + WORLDS], env=environment, capture_output=True, text=True,
                         timeout=PATIENCE_S)
    if "bug:" in run.stderr + run.stdout:
        return seeds
    found = re.search(r"logged: (\d+) of \d+ worlds broke", run.stdout)
    if not found and "test cases: 1" not in re.sub(" +", " ", run.stdout):
        raise RuntimeError(f"no verdict: {run.stdout[-500:]} {run.stderr[-500:]}")
    return int(found[1]) if found else 0


class Mutants(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.commands = ninja_commands("test_session")

    def worlds_broken_by(self, source, *changes, seeds=SEEDS):
        text = pathlib.Path(source).read_text()
        for sound, broken in changes:
            self.assertEqual(text.count(sound), 1, f"{source}: {sound!r} is not there exactly once")
            text = text.replace(sound, broken)
        with tempfile.TemporaryDirectory() as folder:
            mutant, compiled, program = (pathlib.Path(folder) / name for name in ("mutant.cpp", "m.o", "t"))
            mutant.write_text(text)
            for command in (compile_command(self.commands, source, mutant, compiled),
                            link_command(self.commands, compiled, program)):
                subprocess.run(command, cwd=BUILD, check=True, capture_output=True, text=True)
            return broken_worlds(program, seeds)

    def check(self, source, *changes, seeds=SEEDS):
        broken = self.worlds_broken_by(source, *changes, seeds=seeds)
        print(f"{self.id().rsplit('.', 1)[-1]}: {broken} of {seeds} worlds broke")
        self.assertGreater(broken, 0)

    def test_0_the_sound_program_breaks_none(self):
        self.assertEqual(broken_worlds(BUILD / "test_session", SEEDS), 0)

    def golden_hash(self, program):
        run = subprocess.run([program, "-tc=the golden round is the same*"], check=True, capture_output=True, text=True)
        return re.search("golden hash: ([0-9a-f]{64})", run.stdout)[1]

    def test_a_compiler_that_rounds_otherwise_has_another_golden_round(self):
        commands = ninja_commands("test_render")
        sound = self.golden_hash(BUILD / "test_render")
        for source in ("src/shading/bsdf.cpp", "src/scene/light_sampling.cpp", "src/scene/texture.cpp"):
            with tempfile.TemporaryDirectory() as folder, self.subTest(source):
                compiled, program = pathlib.Path(folder) / "m.o", pathlib.Path(folder) / "t"
                compile_otherwise = compile_command(commands, source, pathlib.Path(source).resolve(), compiled)
                compile_otherwise[-1:-1] = ["-ffast-math", "-ffp-contract=fast", "-mfma"]
                for command in (compile_otherwise, link_command(commands, compiled, program, "test_render")):
                    subprocess.run(command, cwd=BUILD, check=True, capture_output=True, text=True)
                self.assertNotEqual(self.golden_hash(program), sound)

    def test_ledger_counts_twice(self):
        """The round's records stay, so that a second result of it is accepted like the first."""
        self.check(LEDGER, ("    for (const LeaseId id : active.leases) records_.erase(id);\n    active_.erase(round);\n", ""))

    def test_ledger_loses_a_lease(self):
        self.check(LEDGER, ("    if (reopens) reopened_.push_back(round);\n", ""))

    def test_ledger_takes_results_of_an_old_epoch(self):
        """A stale result is taken for that of the lease on the same samples."""
        self.check(
            LEDGER,
            ("    if (claim.epoch < plan_.epoch) return Verdict::stale_epoch;\n",
             "    if (claim.epoch < plan_.epoch) {\n"
             "        for (const auto& [id, record] : records_)\n"
             "            if (record.lease.unit == claim.unit && record.lease.first == claim.first)\n"
             "                return Verdict::accepted;\n"
             "        return Verdict::stale_epoch;\n"
             "    }\n"),
            ("    Record& record = records_.at(claim.lease);\n",
             "    const auto same_work = [&](const auto& entry) {\n"
             "        return entry.first == claim.lease || (claim.epoch < plan_.epoch &&\n"
             "               entry.second.lease.unit == claim.unit && entry.second.lease.first == claim.first);\n"
             "    };\n"
             "    Record& record = std::find_if(records_.begin(), records_.end(), same_work)->second;\n"))

    def test_a_frame_takes_duplicates(self):
        self.check("src/session/frame_work.cpp",
                   ("    if (commit.verdict != Verdict::accepted) return commit;\n",
                    "    if (commit.verdict != Verdict::accepted && commit.verdict != Verdict::duplicate)\n"
                    "        return commit;\n"))

    def test_a_damaged_message_is_believed(self):
        """Few flips make another message that can be read, hence the larger number of worlds."""
        self.check("src/protocol/decode.cpp",
                   ("    if (sealed && frames[0] != message_head(version, type, frames[1]))\n",
                    "    if (false)\n"), seeds=1500)

    def test_a_server_of_other_bits_is_admitted(self):
        self.check(JOINING, ("    else if (misfit && !config_.relaxed)\n", "    else if (misfit && config_.relaxed)\n"))

    def test_a_round_of_other_bits_is_not_marked(self):
        self.check(JOINING, ("    found->second.same_bits = !misfit;\n", ""), seeds=600)

    def test_a_slow_server_is_called_stuck(self):
        """As if the counter rose only with finished rounds."""
        self.check("src/cluster/progress_watch.cpp",
                   ("    if (counter > counter_ || leases == 0) {\n", "    if (leases == 0) {\n"), seeds=300)

    def test_a_server_says_ready_only_once(self):
        self.check(SERVER, ("    send_answer(message::Credit{session_, credits_, received_});\n    if (phase_ == Phase::work) send_ready();\n", ""))

    def test_a_server_never_asks_for_a_snapshot(self):
        self.check(SERVER_STATE, ("    if (send_monitor(message::SnapshotRequest{",
                                  "    if (!held_ && send_monitor(message::SnapshotRequest{"))


if __name__ == "__main__":
    unittest.main(verbosity=1)
