"""qduino as a person runs it: new, build, check, sim, trace, run, restore; exit codes, files, messages."""

import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import unittest

from sketch_case import PROGRAM, SketchCase

CHECKER = pathlib.Path(__file__).resolve().parents[3] / "tools" / "check_certificate.py"

# The golden case of ARCHITECTURE.md: the bound refuses it, completion time admits it. Its loops
# must not run during a check.
GOLDEN = """
void setup() { Serial.begin(9600); Serial.println("setup was here"); }
void loop(1, 30, 100, 0) { abort(); }
void loop(2, 20, 100, 0) { abort(); }
void loop(3, 4, 10, 0) { abort(); }
"""
ONE_TOO_MANY = "void loop(4, 10001us, 100ms, 0) { abort(); }\n"


# A chain over two cores: 10 ms until loop 1 begins, 40 until loop 2 does, 3 until it ends.
STOP = """
Channel<int> speed;
Chain stop{"stop button to motor"};
void setup() { stop.from(2).through(1).over(speed).through(2).to(9).reactsWithin(LIMIT).freshWithin(20); }
void loop(1, 2, 10, 0) { delayBusyMicroseconds(1500); speed.write(digitalRead(2)); MORE waitForNextPeriod(); }
void loop(2, 3, 40, 1) { delayBusyMicroseconds(2500); digitalWrite(9, speed.read()); waitForNextPeriod(); }
"""


class Qduino(SketchCase):
    def test_from_new_to_a_trace(self):
        new = self.run_qduino("new", "blinker")
        self.assertEqual(new.stdout, "blinker/blinker.ino\n")
        self.assertEqual(new.stderr, "Next: cd blinker && qduino check\n")
        self.assertEqual(self.run_qduino("new", "it's here/second").stderr, "Next: cd 'it'\\''s here/second' && qduino check\n")
        ino = self.folder / "blinker" / "blinker.ino"
        made = ino.read_bytes()
        refused = self.run_qduino("new", "blinker", status=1)
        self.assertIn("exists already", refused.stderr)
        self.assertEqual(ino.read_bytes(), made)
        self.run_qduino("new", status=106)
        self.assertIn("no such command: bulid", self.run_qduino("bulid", status=109).stderr)
        self.assertIn("a sketch's name", self.run_qduino("new", "a b", status=1).stderr)

        built = self.run_qduino("build", "blinker")
        programs = [pathlib.Path(line) for line in built.stdout.splitlines()]
        self.assertEqual([p.name for p in programs], ["blinker-sim", "blinker-linux"])
        self.assertTrue(all(os.access(p, os.X_OK) for p in programs))
        self.assertIn("Compiling blinker.ino", built.stderr)
        again = self.run_qduino("build", ino)
        self.assertEqual(again.stderr, "Verdict: blinker is up to date.\n")
        self.assertEqual(again.stdout, built.stdout)
        copied = self.run_qduino("build", "blinker", "--only", "sim", "--output", "out")
        self.assertEqual(copied.stdout, "out/blinker-sim\n")
        self.assertEqual((self.folder / "out" / "blinker-sim").read_bytes(), programs[0].read_bytes())

        # A source that joins, with a warning: the rest is not made again; the warning is said
        # again.
        self.write("blinker/src/deep/extra.c", "int extra(void) { int unused; return 1; }\n")
        grown = self.run_qduino("build", "blinker")
        self.assertIn("Compiling src/deep/extra.c", grown.stderr)
        self.assertNotIn("Compiling blinker.ino", grown.stderr)
        self.assertIn("unused variable", grown.stderr)
        self.assertNotIn("\033", grown.stderr)
        quiet = self.run_qduino("build", "blinker")
        self.assertNotIn("Compiling", quiet.stderr)
        self.assertIn("unused variable", quiet.stderr)
        self.assertIn("-c ", self.run_qduino("build", "blinker", "--verbose", CXXFLAGS="-DOTHER").stderr)

        runs = [self.run_qduino("sim", "blinker", "--for", "3.5", "--seed", "3") for _ in range(2)]
        self.assertEqual(runs[0].stdout.split(), ["blinks:", "1", "blinks:", "3", "blinks:", "5", "blinks:", "7"])
        self.assertEqual(runs[0].stderr.splitlines()[-1], runs[1].stderr.splitlines()[-1])
        self.assertRegex(runs[0].stderr, r"4\.000000 s, trace hash [0-9a-f]{16}")

        traced = self.run_qduino("trace", "blinker", "--for", "1")
        self.assertIn("blinker-trace.json", traced.stderr)
        with open(self.folder / "blinker-trace.json", encoding="utf-8") as file:
            names = [event["name"] for event in json.load(file)]
        self.assertEqual(names.count("release"), 4 + 1 + 2)  # and the two that a stop lets begin
        if os.geteuid() != 0:
            self.assertIn("run this as root", self.run_qduino("trace", "blinker", "--linux", status=1).stderr)
        elif not os.path.isdir("/sys/kernel/tracing/instances") and not os.path.isdir("/sys/kernel/debug/tracing/instances"):
            self.assertIn("mount -t tracefs", self.run_qduino("trace", "blinker", "--linux", status=1).stderr)
        self.run_qduino("trace", "blinker", "--linux", "--seed", "3", status=108)  # the simulator's alone

    def test_compile_errors_point_into_the_ino(self):
        self.write("two/two.ino", "void setup() {}\nvoid loop() {\n  helper(1);\n}\n")
        self.write("two/second.ino", "// a tab\n\nvoid helper(int n) {\n  number = n;\n}\n")
        failed = self.run_qduino("build", "two", status=1)
        self.assertRegex(failed.stderr, r"second\.ino:4:\d+: error: .*number")
        self.assertNotIn("sketch.ino.cpp:", failed.stderr)
        self.assertIn("two is not built", failed.stderr)
        self.write("two/second.ino", "// a tab\n\nvoid helper(int n) {\n  (void)n;\n}\n")
        self.run_qduino("build", "two", "--only", "sim")
        self.assertIn("no .ino file", self.run_qduino("build", ".", status=1).stderr)
        self.assertIn("no such sketch", self.run_qduino("sim", "nowhere", status=1).stderr)
        home = self.run_qduino("build", "two", status=1, QDUINO_HOME="/nonexistent")
        self.assertIn("QDUINO_HOME", home.stderr)

    def test_an_editor_builds_finds_mistakes_and_knows_the_headers(self):
        self.run_qduino("new", "blinker")
        tasks = json.loads((self.folder / "blinker" / ".vscode" / "tasks.json").read_text(encoding="utf-8"))["tasks"]
        build = next(task for task in tasks if task["label"] == "build")
        ino = self.folder / "blinker" / "blinker.ino"
        ino.write_text(ino.read_text(encoding="utf-8") + "int twice(int n) { return 2 * m; }\n", encoding="utf-8")
        failed = self.run_qduino(*build["args"], "blinker", status=1)
        pattern = build["problemMatcher"]["pattern"]
        found = [match for match in (re.match(pattern["regexp"], line) for line in failed.stderr.splitlines()) if match]
        line = len(ino.read_text(encoding="utf-8").splitlines())
        self.assertEqual([(m[pattern["file"]], m[pattern["line"]], m[pattern["severity"]]) for m in found][:1],
                         [(os.path.realpath(ino), str(line), "error")])

        ino.write_text(ino.read_text(encoding="utf-8").replace("* m", "* n"), encoding="utf-8")
        self.run_qduino(*build["args"], "blinker", "--only", "linux")
        entries = json.loads((self.folder / "blinker" / "compile_commands.json").read_text(encoding="utf-8"))
        self.assertEqual([pathlib.Path(entry["file"]).name for entry in entries], ["blinker.ino", "sketch.ino.cpp"])
        tab = entries[0]
        self.assertEqual(tab["file"], os.path.realpath(ino))
        seen = subprocess.run([*tab["arguments"], "-fsyntax-only"], cwd=tab["directory"], capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual((seen.returncode, seen.stderr), (0, ""))

    def test_what_the_bound_refuses_and_completion_time_admits_is_admitted(self):
        sketch = self.write("golden.ino", GOLDEN)
        checked = self.run_qduino("check", sketch)
        self.assertIn("golden: admitted on 2 cores\n", checked.stdout)
        self.assertIn("core 0: admitted, utilisation 0.9000: even at worst, each ends in time (R <= T)\n"
                      "  loop 3   R 4 ms of T 10 ms\n"
                      "  loop 1   R 54 ms of T 100 ms\n"
                      "  loop 2   R 90 ms of T 100 ms\n", checked.stdout)
        # 50 and 86 where no loop may use a budget late in one period and early in the next.
        self.assertIn("A sleep within a release (delay()) is in R only if it is declared. Room for it:\n", checked.stdout)
        self.assertIn("Counted here: the loops alone.", checked.stdout)
        self.assertNotIn("setup was here", checked.stdout + checked.stderr)
        self.assertLessEqual(max(map(len, checked.stdout.splitlines())), 80)

        report = json.loads(self.run_qduino("check", sketch, "--json").stdout)
        self.assertEqual(list(report), ["sketch", "admitted", "board", "setup_ran", "loops", "io", "cores", "overheads",
                                        "locks_that_say_nothing", "refusals", "chains", "explanation"])
        self.assertEqual((report["sketch"], report["admitted"], report["setup_ran"]), ("golden", True, False))
        self.assertEqual(report["board"], {"cores": 2, "file": None})
        self.assertEqual(report["loops"][1], {
            "id": 2, "core": 0, "budget_ns": 20_000_000, "period_ns": 100_000_000, "response_ns": 90_000_000, "meets": True,
            "file": os.path.realpath(sketch), "line": 4})
        self.assertEqual(report["cores"], [{"core": 0, "admitted": True, "by": "completion_time", "utilisation": 0.9,
                                            "bound": 0.779763}])
        self.assertEqual((report["io"], report["refusals"]), ([], []))
        self.assertEqual(report["overheads"][0], {"core": 0, "release_ns": 0, "enforcement_ns": 0, "interferers": []})

        # With what a board takes, the same set is refused.
        board = self.write("busy.toml", "[sim.costs]\ncontext_switch = \"50 us\"\n"
                                        "[[sim.interrupt]]\ndevice = \"nic\"\nrate_hz = 1000\ntop_half = \"100 us\"\n")
        counted = self.run_qduino("check", sketch, "--board", board, status=2)
        self.assertIn("core 0: 100 us per release", counted.stdout)
        self.assertIn("interrupts: 100 us every 500 us, up to 18 at once\n", counted.stdout)

    def test_a_certificate_holds_and_a_changed_one_does_not(self):
        full = """
            Mutex m;
            void answer() {}
            void setup() {
              m.heldBy(1, 2ms); m.heldBy(2, 4ms);
              attachInterruptVcpu(5, answer, CHANGE, 2, 100, 0);
            }
            void loop(1, 10, 50, 0) { abort(); }
            void loop(2, 10, 100, 0, 20, 1) { abort(); }
            void loop(3, 20, 200, 0) { abort(); }
        """
        apart = """
            Mutex m;
            void setup() { m.heldBy(1, 2ms); m.heldBy(2, 3ms); }
            void loop(1, 10, 50, 0) { abort(); }
            void loop(2, 20, 100, 1) { abort(); }
            void loop(3, 5, 40, 1) { abort(); }
        """
        for name, sketch in (("golden", GOLDEN), ("apart", apart), ("full", full)):
            path = self.write(f"{name}/{name}.ino", sketch)
            self.run_qduino("check", path, "--certificate", "seen.json")
            self.assertEqual(self.judge("seen.json"), (0, ""))
            certificate = json.loads((self.folder / "seen.json").read_text(encoding="utf-8"))
            for loop in certificate["cores"][0]["loops"]:
                loop["response_ns"] -= loop["budget_ns"] // 2
            self.write("changed.json", json.dumps(certificate))
            status, said = self.judge("changed.json")
            self.assertEqual(status, 1)
            self.assertIn("claimed R = ", said)
        self.assertEqual([section["length_ns"] for section in certificate["cores"][0]["sections"]], [2_000_000, 4_000_000])
        self.assertEqual([loop["suspension_ns"] for loop in certificate["cores"][0]["loops"]], [0, 20_000_000, 0])
        # It is of its sketch, and of no other.
        self.assertEqual(self.judge("seen.json", "--sketch", path), (0, ""))
        status, said = self.judge("seen.json", "--sketch", self.write("other.ino", full + "// changed"))
        self.assertEqual(status, 1)
        self.assertIn("it is not of this source: ", said)
        # What is refused has none.
        self.run_qduino("check", self.write("no/no.ino", GOLDEN + ONE_TOO_MANY), "--certificate", "no.json", status=2)
        self.assertFalse((self.folder / "no.json").exists())

    def test_a_mutex_of_freertos_that_says_nothing_is_named(self):
        sketch = self.write("tasks/tasks.ino", """
            #include <Arduino_FreeRTOS.h>
            #include <semphr.h>
            SemaphoreHandle_t mutex;
            void task(void*) { for (;;) { xSemaphoreTake(mutex, portMAX_DELAY); xSemaphoreGive(mutex); vTaskDelay(2); } }
            void setup() {
              mutex = xSemaphoreCreateMutex();
              for (int i = 0; i < 6; i++) xTaskCreate(task, "task", 100, nullptr, i % 4);
            }
            void loop() { delay(100); }
        """)
        checked = self.run_qduino("check", sketch).stdout
        self.assertRegex(checked, r"R is UNKNOWN [^:]*:\n  a FreeRTOS mutex\.")
        self.assertRegex(checked, r"Verdict: tasks is admitted on .*; R is unknown if a FreeRTOS mutex is shared\.\n")
        self.assertIn("R unknown", self.run_qduino("sim", sketch, "--for", "1").stderr)

    def write_stop(self, name, limit, more=""):
        return self.write(f"{name}/{name}.ino", STOP.replace("LIMIT", limit).replace("MORE", more))

    def test_a_chain_is_bounded_certified_and_measured(self):
        sketch = self.write_stop("stop", "60ms")
        checked = self.run_qduino("check", sketch, "--certificate", "stop.json").stdout
        self.assertIn("chain stop button to motor:\n    pin 2 > loop 1 > loop 2 > pin 9\n  reaction 53 ms of 60 ms, age 13 ms of 20 ms\n", checked)
        chain = json.loads(self.run_qduino("check", sketch, "--json").stdout)["chains"][0]
        self.assertEqual([chain[key] for key in ("name", "from", "to", "reaction_ns", "age_ns", "holds", "wrong")],
                         ["stop button to motor", "pin 2", "pin 9", 53_000_000, 13_000_000, True, None])
        self.assertEqual([(stage["id"], stage["reaction_step_ns"]) for stage in chain["stages"]], [(1, 10_000_000), (2, 40_000_000)])
        self.assertEqual(self.judge("stop.json"), (0, ""))
        certificate = json.loads((self.folder / "stop.json").read_text(encoding="utf-8"))
        certificate["chains"][0]["reaction_ns"] -= 1
        self.write("changed.json", json.dumps(certificate))
        status, said = self.judge("changed.json")
        self.assertEqual(status, 1)
        self.assertIn("chain stop button to motor: claimed reaction = 52999999 ns, and 53000000 ns follow", said)
        # Loop 2 reads at 40 ms what loop 1 read at 30, and passes it on at 42.5. What changed just
        # behind 30 comes out at 82.5.
        seen = self.run_qduino("sim", sketch, "--for", "1").stderr
        self.assertIn("Chain stop button to motor: reaction 52.5 ms at worst, bound 53 ms (23\nreactions); age 12.5 ms at worst, bound 13 ms.\n", seen)
        self.run_qduino("profile", sketch, "--sim", "--for", "1", "-o", "p.json")
        profile = json.loads((self.folder / "p.json").read_text(encoding="utf-8"))
        self.assertEqual(profile["chains"][0]["reaction_ns"], 52_500_000)

    def test_a_chain_that_is_too_long_is_refused_and_one_beyond_its_bound_is_named(self):
        refused = self.run_qduino("check", self.write_stop("late", "50ms"), status=2).stdout
        self.assertIn("""chain stop button to motor is refused:
    pin 2 > loop 1 > loop 2 > pin 9
  reaction 53 ms > 50 ms, at worst:
    until loop 1 begins                    10 ms
    from loop 1 to loop 2                  40 ms
    until loop 2 ends                       3 ms
    together                               53 ms
  age 13 ms of 20 ms
  longest period with which it would hold, each alone:
    loop 1                                  5 ms
    loop 2                                 35 ms
""", refused)
        self.assertIn("late is REFUSED on 2 cores: chain stop button to motor.", refused)
        # Loop 1 does not keep what it declares: each second release is never run.
        beyond = self.run_qduino("sim", self.write_stop("beyond", "60ms", "delay(35);"), "--for", "1", status=1).stderr
        self.assertIn("; BEYOND ITS BOUND: chain stop button to motor.", beyond)

    def judge(self, name, *options):
        """What the checker says, which shares no code with us: its status, and what does not hold."""
        done = subprocess.run([sys.executable, CHECKER, self.folder / name, *options], capture_output=True, text=True, timeout=300, check=False)
        return done.returncode, "\n".join(done.stdout.splitlines()[:-1])

    def test_what_is_just_past_it_is_refused_with_reasons(self):
        sketch = self.write("golden/golden.ino", GOLDEN + ONE_TOO_MANY)
        refused = self.run_qduino("check", "golden", status=2)
        self.assertIn("golden: REFUSED on 2 cores\n", refused.stdout)
        self.assertIn("loop 4 (10.001 ms in 100 ms) is refused on core 0:\n"
                      "  R = 186.001 ms > T = 100 ms\n"
                      "  who takes its 100 ms, at worst:\n"
                      "    loop 4 itself                      10.001 ms\n"
                      "    loop 3                                 40 ms\n"
                      "    loop 1                                 30 ms\n"
                      "    loop 2                                 20 ms\n"
                      "    together                          100.001 ms\n"
                      "  smallest change that would be admitted, each alone:\n"
                      "    budget 10 ms (1 us less)\n"
                      "    period 186.001 ms (86.001 ms more)\n"
                      "    core 1\n", refused.stdout)

        report = json.loads(self.run_qduino("check", "golden", "--json", "--cores", "1", status=2).stdout)
        self.assertFalse(report["admitted"])
        refusal = report["refusals"][0]
        self.assertEqual(refusal, {
            "because": "completion_time", "id": 4, "io": False, "core": 0, "budget_ns": 10_001_000, "period_ns": 100_000_000,
            "late_loop": 4, "response_ns": 186_001_000,
            "shares": [{"kind": "own", "id": 4, "name": None, "amount_ns": 10_001_000},
                       {"kind": "loop", "id": 3, "name": None, "amount_ns": 40_000_000},
                       {"kind": "loop", "id": 1, "name": None, "amount_ns": 30_000_000},
                       {"kind": "loop", "id": 2, "name": None, "amount_ns": 20_000_000}],
            "smallest_change": {"budget_ns": 10_000_000, "budget_less_by_ns": 1000, "period_ns": 186_001_000,
                                "period_more_by_ns": 86_001_000, "core": None},
            "file": os.path.realpath(sketch), "line": 6})
        self.assertIn("loop 4", report["explanation"])

        # It is refused when it is to run, too, before a loop of it has.
        for command in ("sim", "trace"):
            done = self.run_qduino(command, "golden", status=2)
            self.assertIn("golden.ino:6: loop 4", done.stderr)

    def test_a_sleep_that_nobody_declared_is_measured_and_compared(self):
        sketch = """
            void setup() {}
            void loop(1, 6ms, 20ms, 0) { delayBusyMicroseconds(6000); waitForNextPeriod(); }
            void loop(2, 8ms, 30ms, 0%s) { delay(%d); delayBusyMicroseconds(8000); waitForNextPeriod(); }
        """
        undeclared = self.write("j/j.ino", sketch % ("", 15))
        self.assertIn("Room for it:\n  loop 1 14 ms, loop 2 6 ms.\n", self.run_qduino("check", undeclared).stdout)
        self.assertIn("; undeclared sleep: loop 2.\n", self.run_qduino("sim", undeclared, "--for", "1").stderr)
        self.assertIn("loop 2 slept up to 15 ms within a release and declares 0 ns.\n"
                      "  With that, R = 41 ms > T = 30 ms: it would not be admitted.\n",
                      self.run_qduino("sim", undeclared, "--for", "1").stderr)
        self.write("j/j.ino", sketch % (", 15", 15))
        self.assertIn("its sleep                              15 ms", self.run_qduino("check", undeclared, status=2).stdout)
        self.write("j/j.ino", sketch % ("", 5))
        self.assertNotIn("slept", self.run_qduino("sim", undeclared, "--for", "1").stderr)

    def test_io_vcpus_that_setup_declares_are_in_the_table(self):
        self.write("io/io.ino", """
            void pressed() {}
            void setup() {
              Serial.begin(9600);
              Serial.println("setup was here");
              const int budget = getenv("TOO_MUCH") ? 61 : 1;
              attachInterruptVcpu(2, pressed, RISING, budget, 100, 0);
            }
            void loop(1, 40, 100, 0) { abort(); }
        """)
        done = self.run_qduino("check", "io", "--json")
        self.assertIn("setup was here", done.stderr)
        report = json.loads(done.stdout)
        self.assertTrue(report["admitted"] and report["setup_ran"])
        self.assertEqual(report["io"], [{"id": 33, "core": 0, "budget_ns": 1_000_000, "period_ns": 100_000_000,
                                         "response_ns": 81_000_000, "replenishment_ns": 100_000_000}])
        self.assertIn("io 33 ", self.run_qduino("check", "io").stdout)

        refused = self.run_qduino("check", "io", status=2, TOO_MUCH="1")
        self.assertIn("I/O VCPU 33 (61 ms in 100 ms) is refused on core 0:\n  I/O VCPU 33 would be served late for a loop of its core:\n", refused.stdout)
        report = json.loads(self.run_qduino("check", "io", "--json", status=2, TOO_MUCH="1").stdout)
        self.assertFalse(report["admitted"])
        self.assertEqual([(r["because"], r["id"], r["io"], r["shares"][1]["kind"], r["shares"][1]["id"]) for r in report["refusals"]],
                         [("late_service", 33, True, "loop", 1)])

    def test_a_bottom_half_changes_its_budget_and_is_held_against_its_promise(self):
        self.write("button/button.ino", """
            void pressed() { delayBusyMicroseconds(2000); }
            void setup() {
              pinMode(2, OUTPUT);
              interruptsVcpu(GPIO, 10, 100, 0);
              attachInterrupt(2, pressed, RISING);
            }
            void loop(1, 60, 100, 0) {
              static int turn = 0;
              if (++turn == 4) printf("granted %d, ", interruptsVcpu(GPIO, 20, 100));
              if (turn == 5) printf("refused %d\\n", interruptsVcpu(GPIO, 21, 100));
              for (int i = getenv("MANY") ? 30 : 1; i > 0; --i) {
                digitalWrite(2, HIGH);
                digitalWrite(2, LOW);
              }
              waitForNextPeriod();
            }
        """)
        done = self.run_qduino("sim", "button", "--for", "0.95", "--report", "held.json")
        self.assertIn("granted 1, refused 0\n", done.stdout)
        self.assertIn("with this budget, io 33 on core 0 would need 141 ms of its 100 ms", done.stderr)
        self.assertRegex(" ".join(done.stderr.split()),
                         r"Handlers of io 33: 10 edges, begun 0 ns after it .*; done 2 ms after it at worst. R is 140 ms: kept")
        with open(self.folder / "held.json", encoding="utf-8") as file:
            report = json.load(file)
        self.assertEqual(report["loops"][1]["budget_us"], 20_000)
        half = report["bottom_halves"][0]
        self.assertEqual([half[key] for key in ("id", "timed", "untimed", "begin_worst_us", "end_worst_us", "replenishment_us")],
                         [33, 10, 0, 0, 2000, 100_000])
        self.assertEqual(half["response_us"], 140_000)

        late = self.run_qduino("sim", "button", "--for", "0.95", MANY="1").stderr
        self.assertRegex(" ".join(late.split()), r"Handlers of io 33: .*: NOT kept. More came than its budget serves")

    def test_a_trace_has_every_kind_of_event(self):
        self.write("busy/busy.ino", """
            void setup() {}
            void loop(1, 1, 5, 0) { delayBusyMicroseconds(200); waitForNextPeriod(); }
            void loop(2, 20, 50, 0) { delayBusyMicroseconds(10000); waitForNextPeriod(); }
            void loop(3, 2, 100, 0) { delayBusyMicroseconds(250000); waitForNextPeriod(); }
        """)
        board = self.write("nic.toml", "[[sim.interrupt]]\ndevice = \"nic\"\nrate_hz = 500\ntop_half = \"20 us\"\n")
        self.run_qduino("trace", "busy", "--board", board, "--for", "5", "-o", "busy.json")
        with open(self.folder / "busy.json", encoding="utf-8") as file:
            events = json.load(file)
        instants = {event["name"] for event in events if event["ph"] == "i"}
        self.assertEqual(instants, {"release", "preempt", "throttle", "replenish", "overrun", "interrupt", "block", "finish"})
        self.assertEqual({event["args"]["device"] for event in events if event["name"] == "interrupt"}, {"nic"})
        threads = {event["args"]["name"] for event in events if event["name"] == "thread_name"}
        self.assertEqual(threads, {"loop 1", "loop 2", "loop 3", "interrupts"})
        times = [event["ts"] for event in events if event["ph"] == "i"]
        self.assertEqual(times, sorted(times))
        # Loop 3 always wants more than its 2 ms in every 100 ms, and never has it.
        stretches = [event["dur"] for event in events if event["ph"] == "X" and event["name"] == "loop 3"]
        self.assertLess(sum(stretches), 51 * 2000)
        self.assertGreater(sum(stretches), 25 * 2000)

        wrong = self.write("wrong.toml", "[sim]\nclock = 3\n")
        for command in ("sim", "check", "trace", "run"):
            done = self.run_qduino(command, "busy", "--board", wrong, status=1)
            self.assertRegex(done.stderr, r"wrong\.toml:2: \[sim\] 'clock' is not known; accepted: cores, seed")
        done = self.run_qduino("sim", "busy", "--board", self.write("cores.toml", "[sim]\ncores = 4\n[[sim.interrupt]]\n"
                               "device = \"nic\"\nrate_hz = 1\ncore = 3\n"), "--cores", "1", status=1)
        self.assertIn("on core 3, but there are only 1 cores", done.stderr)

    def test_the_kernel_traces_a_run_on_linux(self):
        self.trace_on_linux("-o", "busy.json")
        with open(self.folder / "busy.json", encoding="utf-8") as file:
            events = json.load(file)
        threads = {event["args"]["name"] for event in events if event["name"] == "thread_name"}
        self.assertLessEqual({"loop 1", "loop 2"}, threads)
        self.assertLessEqual({"wake", "block", "throttle"}, {event["name"] for event in events if event["ph"] == "i"})
        stretches = [event for event in events if event["ph"] == "X" and event["name"].startswith("loop")]
        self.assertTrue(stretches)
        self.assertTrue(all(event["dur"] >= 0 for event in stretches))

    def test_run_holds_the_safe_states_and_reports_the_guarantees(self):
        self.write("lamp/lamp.ino", """
            #include <fstream>
            void setup() {
              std::ifstream words("/proc/self/cmdline");
              for (std::string word; std::getline(words, word, '\\0');) printf("%s ", word.c_str());
              fflush(stdout);
              pinMode(5, OUTPUT);
              safeState(5, LOW);
            }
            void loop(1, 1, 20) {
              digitalWrite(5, HIGH);
              if (getenv("DIE")) abort();
              waitForNextPeriod();
            }
        """)
        done = self.run_qduino("run", "lamp", "--best-effort", "--for", "0.3", "--report", "held.json")
        self.assertIn("No pins are named", done.stderr)
        self.assertIn("What holds on this board (linux, best effort", done.stderr)
        with open(self.folder / "held.json", encoding="utf-8") as file:
            report = json.load(file)
        self.assertEqual([loop["id"] for loop in report["loops"]], [1])
        self.assertFalse(report["loops"][0]["priority_enforced"])
        self.assertIn("SCHED_FIFO was not asked for", report["loops"][0]["shortfall"])

        died = self.run_qduino("run", "lamp", "--best-effort", status=134, DIE="1")
        self.assertRegex(died.stderr, r"died of signal 6 .*; 1 pin forced to safe states")
        # Its pins were in memory, and are gone with it.
        for run in (done, died):
            pins = re.search(r"--pins (/dev/shm/qduinomc\.\w+)/pins", run.stdout)
            self.assertTrue(pins, run.stdout)
            self.assertFalse(os.path.exists(pins[1]))

        # A signal to qduino alone stops the sketch, and well.
        running = subprocess.Popen([PROGRAM, "run", "lamp", "--best-effort"], cwd=self.folder, env=self.environment, text=True,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        self.addCleanup(running.kill)
        for line in running.stderr:
            if line.startswith("What holds"):
                break
        running.send_signal(signal.SIGTERM)
        rest = running.communicate(timeout=300)[1]
        self.assertEqual(running.returncode, 0, rest)
        self.assertIn("it ended with status 0; 1 pin forced to safe states", rest)

    def test_restore_undoes_what_a_dead_sketch_left(self):
        self.assertIn("Nothing to undo", self.run_qduino("restore", "--state", self.folder / "none").stdout)
        setting = self.write("setting", "0\n")
        with open("/proc/sys/kernel/random/boot_id", encoding="utf-8") as file:
            boot = file.read().strip()
        state = self.write("settings.state", f"qduino-settings 1 {boot}\nwrite\t{setting}\t3\n")
        self.assertIn("is as it was before", self.run_qduino("restore", "--state", state).stdout)
        self.assertEqual(pathlib.Path(setting).read_text(encoding="utf-8").strip()[0], "3")
        self.assertIn("Nothing to undo", self.run_qduino("restore", "--state", state).stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
