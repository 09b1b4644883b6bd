"""The simulation must be able to fail: bugs are put in on purpose, one at a time, and each must break a world. So must the tests
of the classic system's defects, S1 to S13 of docs/testing.md: where a few words bring the defect back, its test must fail.

    test_mutants.py BUILD [--all]    BUILD: a configured build folder with test_session, test_cluster, test_protocol and test_render
                                     in it

Without --all, those of the ledger, and of the others a third: which, the commit says, so that three commits or so try all.

A mutant is one source file with a few words changed, compiled as the build compiles it, only with less of an effort, and
linked into the test before the library that holds the sound one. Within 100 seeds (a few more where said) some world must
break; the first that does is enough. And a compiler that rounds otherwise must show in the golden round.
"""
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest
import zlib

BUILD = pathlib.Path(sys.argv.pop(1)).resolve()
ALL = "--all" in sys.argv and not sys.argv.remove("--all")
SHARES = 3
WORLDS = "whatever the network does*"
SEEDS = 100
PATIENCE_S = 600

LEDGER = "src/cluster/ledger.cpp"
CLIENT = "src/session/client_machine.cpp"
SERVER = "src/session/server_machine.cpp"
SERVER_STATE = "src/session/server_state.cpp"
JOINING = "src/session/client_joining.cpp"
RELAY_WORK = "src/session/relay_work.cpp"
HEARTBEATS = "src/session/client_heartbeats.cpp"
AUDIT = "src/session/client_audit.cpp"

# What one event at a time shows (staged_cluster.hpp): the beginning of the test's name, the source, sound, broken.
STAGED = [
    ("a server that leaves is heard", HEARTBEATS, "        if (was_unreachable) {\n", "        if (was_unreachable || true) {\n"),
    ("a HELLO that is said again", "src/session/admission.cpp", "    if (same_before && *same_before != !misfit)\n", "    if (same_before && false)\n"),
    ("a bit that flips in a routing id", JOINING, "than its connection has.\", 1000};", "than its connection has.\", 0};"),
    ("a bit that flips in a routing id", SERVER_STATE, "        return relink(fmt::format(\"The client cannot admit it so", "        return void(fmt::format(\"The client cannot admit it so"),
    ("a bit that flips in a routing id", HEARTBEATS, "    if (ask_who(server.instance))\n", "    if (false)\n"),
    ("a server that owes answers", HEARTBEATS, "now_ - server.frames_heard < std::max(", "now_ < std::max("),
    ("a peer of another version", CLIENT, " && may_answer(instance))\n", ")\n"),
    ("over a wire that loses bits", AUDIT, "    if (wire != WireFormat::exact) {\n", "    if (false) {\n"),
    ("who gave a false result under one number", AUDIT, "        if (other.who == liar.who) numbers", "        if (id == item.author) numbers"),
    ("who is there under two numbers", AUDIT, "return authors_.at(author).who != server.who;", "return authors_.contains(author);"),
    ("a result so late that its lease", "src/session/client_work.cpp", "= verdict == Verdict::unknown ||", "= verdict == Verdict::forgotten ||"),
    ("a result that was on its way", LEDGER, "    return Verdict::forgotten;\n", "    return Verdict::unknown;\n"),
    ("an adaptive frame that begins anew", CLIENT, "    if (!same_frame) differing_rounds_ = 0;", "    differing_rounds_ = 0;"),
    ("an adaptive frame that begins anew", AUDIT, "        if (differs) differing_rounds_ -= one.rounds;\n", ""),
    ("what was counted for light that is taken back", "src/probe/event_store.cpp", "        taken_back_[index] += n;\n", ""),
    ("however unlike the budgets", "src/session/frame_work.cpp", "    if (!has_image() || has_end(", "    if (has_end("),
    ("a part that has an end reaches it", "src/session/frame_work.cpp", "has_end(direct_) != has_end(indirect_))\n", "false)\n"),
]


def share_of_commit():
    found = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True)
    return int(found.stdout, 16) % SHARES if found.returncode == 0 else 0


def is_chosen(name):
    always = name.startswith(("test_ledger_", "test_0_", "test_S0_", "test_each_"))
    return ALL or always or zlib.crc32(name.encode()) % SHARES == share_of_commit()


def ninja_commands(target):
    text = subprocess.run(["ninja", "-C", BUILD, "-t", "commands", target], check=True,
                          capture_output=True, text=True).stdout
    return text.splitlines()


def compile_command(commands, source, mutant, out, effort=None):
    """As the build compiles it, into another file; with another level of optimisation if one is given."""
    line = next(line for line in commands if line.endswith(f" -c {pathlib.Path(source).resolve()}"))
    words = shlex.split(line)
    del words[words.index("-MD"):words.index("-o")]  # No dependency file.
    words[words.index("-o") + 1] = str(out)
    words[-1] = str(mutant)
    if effort:
        words[-1:-1] = [effort]  # The last one counts.
    return [*words, f"-I{pathlib.Path(source).resolve().parent}"]


def link_command(commands, target, extra, out):
    line = next(line for line in reversed(commands) if f" -o {target} " in line)
    words = shlex.split(re.sub(r"^: && | && :$", "", line))
    words[words.index("-o") + 1] = str(out)
    first_object = next(i for i, word in enumerate(words) if word.endswith(".o"))
    return [*words[:first_object], str(extra), *words[first_object:]]


def failed_tests(program, pattern):
    """Of those whose name fits. A program that stops at a CHECK of its own has noticed as well."""
    run = subprocess.run([program, "-tc=" + pattern], capture_output=True, text=True, errors="replace", timeout=PATIENCE_S)
    if "bug:" in run.stderr + run.stdout:
        return 1
    found = re.search(r"test cases: +(\d+) \| +\d+ passed \| +(\d+) failed", run.stdout)
    if not found or found[1] == "0":
        raise RuntimeError(f"no verdict on {pattern}: {run.stdout[-500:]} {run.stderr[-500:]}")
    return int(found[2])


def first_broken_world(program, seeds, variables):
    """The seed of one, if any broke. A program that stops at a CHECK of its own has noticed as well."""
    environment = dict(os.environ, PATHSCOPE_SEEDS=str(seeds), PATHSCOPE_UNTIL_BROKEN="1", **variables)
    run = subprocess.run([program, "-tc=" + WORLDS], env=environment, capture_output=True, text=True,
                         timeout=PATIENCE_S)
    if "bug:" in run.stderr + run.stdout:
        return "that met a CHECK"
    found = re.search(r"logged: [1-9]\d* of \d+ worlds broke:\s+seed (\d+)", run.stdout)
    if not found and "test cases: 1 | 1 passed" not in re.sub(" +", " ", run.stdout):
        raise RuntimeError(f"no verdict: {run.stdout[-500:]} {run.stderr[-500:]}")
    return found and found[1]


class Mutants(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.commands = {target: ninja_commands(target) for target in ("test_session", "test_cluster", "test_protocol", "test_render")}

    def setUp(self):
        if not is_chosen(self._testMethodName):
            self.skipTest("of another commit's share")

    def verdict_on(self, source, changes, judge, target="test_session"):
        """What `judge` says of the program with the changes."""
        text = pathlib.Path(source).read_text()
        for sound, broken in changes:
            self.assertEqual(text.count(sound), 1, f"{source}: {sound!r} is not there exactly once")
            text = text.replace(sound, broken)
        with tempfile.TemporaryDirectory() as folder:
            mutant, compiled, program = (pathlib.Path(folder) / name for name in ("mutant.cpp", "m.o", "t"))
            mutant.write_text(text)
            for command in (compile_command(self.commands[target], source, mutant, compiled, effort="-O1"),
                            link_command(self.commands[target], target, compiled, program)):
                subprocess.run(command, cwd=BUILD, check=True, capture_output=True, text=True)
            return judge(program)

    def check(self, source, *changes, seeds=SEEDS, **variables):
        broken = self.verdict_on(source, changes, lambda program: first_broken_world(program, seeds, variables))
        print(f"{self.id().rsplit('.', 1)[-1]}: world {broken} broke")
        self.assertIsNotNone(broken, f"none of {seeds} worlds broke")

    def test_0_the_sound_program_breaks_none(self):
        self.assertIsNone(first_broken_world(BUILD / "test_session", SEEDS, {}))

    def golden_hash(self, program):
        run = subprocess.run([program, "-tc=the golden round is the same*"], check=True, capture_output=True, text=True)
        return re.search("golden hash: ([0-9a-f]{64})", run.stdout)[1]

    def test_a_compiler_that_rounds_otherwise_has_another_golden_round(self):
        commands = self.commands["test_render"]
        sound = self.golden_hash(BUILD / "test_render")
        for source in ("src/shading/bsdf.cpp", "src/scene/light_sampling.cpp", "src/scene/texture.cpp"):
            with tempfile.TemporaryDirectory() as folder, self.subTest(source):
                compiled, program = pathlib.Path(folder) / "m.o", pathlib.Path(folder) / "t"
                compile_otherwise = compile_command(commands, source, pathlib.Path(source).resolve(), compiled)
                compile_otherwise[-1:-1] = ["-ffast-math", "-ffp-contract=fast", "-mfma"]
                for command in (compile_otherwise, link_command(commands, "test_render", compiled, program)):
                    subprocess.run(command, cwd=BUILD, check=True, capture_output=True, text=True)
                self.assertNotEqual(self.golden_hash(program), sound)

    def test_ledger_counts_twice(self):
        """The round's records stay, so that a second result of it is accepted like the first."""
        self.check(LEDGER, ("    forget(lease.id);\n    for (std::uint32_t i = 0; i < run.rounds; ++i) active_.erase(run.at(i));\n", ""))

    def test_ledger_counts_a_round_of_several_twice(self):
        """A late result of several rounds is taken though one of them is committed already: what is known of it stays."""
        self.check(LEDGER,
                   ("    forget(id);\n    for (std::uint32_t i = 0; was_outstanding",
                    "    for (std::uint32_t i = 0; was_outstanding"))

    def test_ledger_loses_what_an_overtaken_lease_held_beyond(self):
        """Too rare for a few hundred worlds."""
        failed = self.verdict_on(LEDGER, [("        reopened_.push_back(round);\n        const SampleRange samples",
                                           "        const SampleRange samples")],
                                 lambda program: failed_tests(program, "a late result supersedes*"), "test_cluster")
        self.assertGreater(failed, 0)

    def test_ledger_loses_a_lease(self):
        self.check(LEDGER, ("    for (std::uint32_t i = 0; reopens && i < run.rounds; ++i) reopened_.push_back(run.at(i));\n", ""))

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
        """Few flips make another message that can be read, hence more worlds, with more flips in them."""
        self.check("src/protocol/decode.cpp",
                   ("    if (sealed && frames[0] != message_head(version, type, frames[1]))\n",
                    "    if (false)\n"), seeds=500, PATHSCOPE_DAMAGE="20")

    def test_an_audit_compares_nothing(self):
        self.check("src/cluster/audit.cpp", ("    if (item.result == result) {\n", "    if (true) {\n"), seeds=1500)

    def test_undoing_forgets_a_round(self):
        """The first round of a unit stays committed, without its light."""
        self.check(LEDGER, ("        if (is_kept || !committed(round)) continue;\n",
                            "        if (index == 0 || is_kept || !committed(round)) continue;\n"), seeds=300)

    def test_a_server_of_other_bits_is_admitted(self):
        self.check("src/session/admission.cpp", ("    if (misfit && !relaxed)\n", "    if (misfit && relaxed)\n"))

    def test_a_round_of_other_bits_is_not_marked(self):
        self.check(JOINING, ("    found->second.same_bits = !misfit;\n", ""), seeds=600)

    def test_a_slow_server_is_called_stuck(self):
        """As if the counter rose only with finished rounds."""
        self.check("src/cluster/progress_watch.cpp",
                   ("    if (counter > counter_ || leases == 0) {\n", "    if (leases == 0) {\n"), seeds=300)

    def test_a_relay_adds_duplicates(self):
        self.check(RELAY_WORK, ("    if (commit.verdict != Verdict::accepted) return commit;\n    add(",
                                "    if (commit.verdict != Verdict::accepted && commit.verdict != Verdict::duplicate) return commit;\n    add("),
                   seeds=300)

    def test_a_relay_answers_when_the_first_round_came(self):
        self.check(RELAY_WORK, ("    if (job.ledger.complete()) finish(entry, true);\n", "    finish(entry, true);\n"), seeds=300)

    def test_a_relay_without_servers_stays(self):
        self.check("src/session/relay_machine.cpp", ("    if (!above_.linked()) return;\n    if (!any)\n", "    if (any) return;\n    if (false)\n"),
                   ("    else if (now_ - last_ready_ >= k_longest_wait)\n", "    else if (false)\n"))

    def test_a_server_says_ready_only_once(self):
        self.check(SERVER, ("    send_answer(message::Credit{session_, credits_, received_});\n    if (phase_ == Phase::work) send_ready();\n", ""))

    def test_a_server_never_asks_for_a_snapshot(self):
        self.check(SERVER_STATE, ("    if (send_monitor(message::SnapshotRequest{",
                                  "    if (!held_ && send_monitor(message::SnapshotRequest{"))

    def test_each_test_on_the_stage_can_fail(self):
        for name, source, sound, broken in STAGED:
            if not is_chosen(name + broken):
                continue
            with self.subTest(name, source=source):
                failed = self.verdict_on(source, [(sound, broken)], lambda program: failed_tests(program, name + "*"))
                print(f"{name}, without {sound.strip()}: {failed} tests failed")
                self.assertGreater(failed, 0)

    def check_defect(self, number, source, *changes, target="test_session"):
        failed = self.verdict_on(source, changes, lambda program: failed_tests(program, f"S{number}:*"), target)
        print(f"S{number}: {failed} tests failed")
        self.assertGreater(failed, 0)

    def test_S0_the_sound_program_has_no_defect(self):
        for target in self.commands:
            self.assertEqual(failed_tests(BUILD / target, "S*:*"), 0)

    def test_S1_a_death_restarts_all(self):
        self.check_defect(1, "src/session/client_joining.cpp",
                          ("    servers_.erase(found);\n",
                           "    servers_.erase(found);\n    work_.begin(job_.state.settings, Epoch{work_.epoch().value + 1}, now_);\n"))

    def test_S2_a_server_renders_where_it_listens(self):
        self.check_defect(2, "src/session/server_session.cpp",
                          ("    for (RoundOutcome& outcome : runner_.take_finished()) machine_",
                           "    while (runner_.pending() > 0)\n        for (RoundOutcome& outcome : runner_.take_finished()) machine_"))

    def test_S3_nobody_tells_a_server_that_it_was_given_up(self):
        self.check_defect(3, CLIENT, ("    send(Channel::monitor, instance, message::Who{});\n", ""))

    def test_S4_two_bytes_are_an_order_to_end(self):
        self.check_defect(4, "src/protocol/decode.cpp",
                          ("    if (frames.size() < 2 || ",
                           "    if (frames.size() == 1 && frames[0].size() == 2) return Message(message::Bye{ByeReason::stop, {}});\n"
                           "    if (frames.size() < 2 || "), target="test_protocol")

    def test_S6_a_number_has_the_width_of_a_machine(self):
        self.check_defect(6, "src/wire/message_pack.cpp",
                          ("prefixed(prefix::uint16, static_cast<std::uint16_t>(value));", "prefixed(prefix::uint32, static_cast<std::uint32_t>(value));"),
                          target="test_protocol")

    def test_S5_a_server_goes_on_with_the_view_it_has(self):
        self.check_defect(5, SERVER_STATE, ("    if (send_monitor(message::SnapshotRequest{", "    if (!held_ && send_monitor(message::SnapshotRequest{"))

    def test_S7_the_size_of_a_result_is_believed(self):
        self.check_defect(7, "src/protocol/block_result.cpp",
                          ("; tile.raw_bytes != expected)\n", "; false)\n"),
                          ("    if (!unpacked) return bad_input(\"TILE: \" + unpacked.error().message);\n", ""))

    def test_S8_an_unknown_sender_is_a_server(self):
        self.check_defect(8, CLIENT, ("        if (!conduct_.ban_of(who, now_)) ask_who(instance);\n        return;\n",
                                      "        return on_hello(instance, {instance, \"phantom\", \"0\", own_bits().build, 1, 0, own_bits().golden}, sender);\n"))

    def test_S9_each_block_has_the_same_random_numbers(self):
        self.check_defect(9, "src/render/round_renderer.cpp", ("settings.seed, x, y, sample);", "settings.seed, x - round.rect.x, y - round.rect.y, sample);"))

    def test_S10_a_server_sends_what_it_did_not_filter(self):
        self.check_defect(10, "src/session/round_runner.cpp", ("job.settings.filter == FilterPlace::server", "false"))

    def test_S11_a_server_never_dials_again(self):
        self.check_defect(11, SERVER, ("    if (!relink_reason_) relink_reason_ = std::move(why);\n", ""), ("    if (now_ - last_heard_ >= dead_after_) {\n", "    if (false) {\n"))

    def test_S12_light_waits_for_the_end_of_the_frame(self):
        self.check_defect(12, "src/session/frame_work.cpp",
                          ("    return double(part.ledger.rounds_committed()) /\n", "    return !complete(part) ? 0 : double(part.ledger.rounds_committed()) /\n"))

    def test_S13_without_servers_there_is_direct_light_alone(self):
        self.check_defect(13, "src/session/client_leases.cpp",
                          ("    bool idle = false;\n    if (std::exchange(serve_all_", "    announced_alone_ = false;\n    bool idle = false;\n    if (std::exchange(serve_all_"))


if __name__ == "__main__":
    unittest.main(verbosity=1)
