"""tools/check_dead.py on small trees made for it: each kind of finding is found, and what is in order is left alone."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
sys.dont_write_bytecode = True

import check_dead  # noqa: E402
from dead.source import Tree  # noqa: E402

ENGINE_H = """// An engine (engine/engine.cpp). `Engine::run()` is called by main.
#pragma once
namespace toy {
class Fuel {
  public:
    int left() const { return left_; }
  private:
    int left_ = 3;
};
class Engine {
  public:
    void run();
    int turns() const { return turns_; }
  private:
    Fuel fuel_;
    int turns_ = 0;
};
}  // namespace toy
"""
ENGINE_CPP = """#include "engine/engine.h"
namespace toy {
void Engine::run() { turns_ += fuel_.left(); }
}  // namespace toy
"""
MAIN_CPP = """#include "engine/engine.h"
int main() {
    toy::Engine engine;
    engine.run();
    return engine.turns();
}
"""


class Case(unittest.TestCase):
    def found(self, changed=None, allowed=""):
        """What is found in the toy with these files changed or added, without the advice."""
        files = {"engine/engine.h": ENGINE_H, "engine/engine.cpp": ENGINE_CPP, "apps/main.cpp": MAIN_CPP, **(changed or {})}
        with tempfile.TemporaryDirectory() as folder:
            for path, text in files.items():
                to = pathlib.Path(folder) / path
                to.parent.mkdir(parents=True, exist_ok=True)
                to.write_text(text, encoding="utf-8")
            return [line.split(" (")[0] for line in check_dead.check(Tree(folder, files), allowed)]

    def with_engine(self, before, after):
        self.assertIn(before, ENGINE_H)
        return self.found({"engine/engine.h": ENGINE_H.replace(before, after)})


class Reachability(Case):
    def test_a_tree_in_order_has_no_findings(self):
        self.assertEqual(self.found(), [])

    def test_a_method_that_nobody_calls(self):
        self.assertEqual(self.with_engine("    void run();", "    void run();\n    void stop() { turns_ = 0; }"),
                         ["engine/engine.h:13: Engine::stop"])

    def test_a_function_that_only_a_test_calls(self):
        self.assertEqual(self.found({"engine/oil.cpp": "int oil_left() { return 1; }\n",
                                     "tests/oil_test.cpp": "int oil_left();\nint main() { return oil_left(); }\n"}),
                         ["engine/oil.cpp:1: oil_left"])

    def test_a_function_that_only_a_dead_one_calls(self):
        self.assertEqual(self.found({"engine/oil.cpp": "int drop() { return 1; }\nint oil_left() { return drop(); }\n"}),
                         ["engine/oil.cpp:1: drop", "engine/oil.cpp:2: oil_left"])

    def test_a_function_that_calls_itself_alone(self):
        self.assertEqual(self.found({"engine/oil.cpp": "int oil(int n) {\n    return n ? oil(n - 1) : 0;\n}\n"}),
                         ["engine/oil.cpp:1: oil"])

    def test_assembly_calls_functions_and_has_bodies(self):
        text = 'extern "C" {\nvoid pump();\nint oil();\nint sand() { return 1; }\n}\nint oil() { pump(); return 1; }\n'
        self.assertEqual(self.found({"engine/oil.cpp": text, "engine/entry.S": "pump:\n        call    oil\n"}),
                         ["engine/oil.cpp:4: sand"])

    def test_a_name_in_a_comment_or_a_string_is_no_call(self):
        text = 'int oil() { return 1; }\nconst char* word = "oil";  // oil\n'
        self.assertEqual(self.found({"engine/oil.cpp": text}), ["engine/oil.cpp:1: oil"])

    def test_a_dead_class_is_named_once_though_others_have_its_methods_names(self):
        text = "class Pump {\n  public:\n    void run() { left(); }\n    int left() { return 0; }\n};\n"
        self.assertEqual(self.found({"engine/pump.cpp": text}), ["engine/pump.cpp:1: Pump"])

    def test_a_name_means_what_its_translation_unit_sees(self):
        tank = "struct Tank {\n    void drain() {}\n};\n"
        sink = "struct Sink {\n    void drain() {}\n};\n"
        uses = '#include "engine/sink.h"\n#include "engine/any.h"\nSink sink;\nint n = (empty(sink), 0);\n'
        shared = {"engine/tank.h": tank, "engine/sink.h": sink, "engine/uses.cpp": uses,
                  "engine/any.h": "template <class T>\nvoid empty(T& t) {\n    t.drain();\n}\n",
                  "engine/holds.cpp": '#include "engine/tank.h"\nTank tank;\n'}
        self.assertEqual(self.found(shared), ["engine/tank.h:2: Tank::drain"])

    def test_a_constant_and_an_enumerator(self):
        text = "constexpr int kSpare = 1;\nenum class Gear { low, high };\nGear gear = Gear::low;\n"
        self.assertEqual(self.found({"engine/gear.cpp": text}), ["engine/gear.cpp:1: kSpare", "engine/gear.cpp:2: Gear::high"])

    def test_a_static_assertion_is_a_use(self):
        text = "constexpr bool is_sorted() { return true; }\nstatic_assert(is_sorted());\n"
        self.assertEqual(self.found({"engine/table.cpp": text}), [])

    def test_a_digit_separator_begins_no_character(self):
        text = "int oil() { return 1; }\nint a = 1'000 + oil() + 2'000;\n"
        self.assertEqual(self.found({"engine/oil.cpp": text}), [])

    def test_what_overrides_somebody_elses_function_is_called_by_him(self):
        text = "struct Handler : foreign::Handler {\n    void on_event() override {}\n};\nHandler handler;\n"
        self.assertEqual(self.found({"engine/handler.cpp": text}), [])

    def test_our_own_virtual_function_has_to_be_called(self):
        text = ("struct Base {\n    virtual void tick() = 0;\n};\nstruct Clock : Base {\n    void tick() override {}\n};\n"
                "Clock one;\n")
        self.assertEqual(self.found({"engine/clock.cpp": text}), ["engine/clock.cpp:2: Base::tick", "engine/clock.cpp:5: Clock::tick"])


class Bodies(Case):
    def test_a_declaration_without_a_body(self):
        found = self.with_engine("    void run();", "    void run();\n    void stop();")
        self.assertIn("engine/engine.h:13: Engine::stop", found)
        self.assertEqual(len(found), 2, "dead, and without a body")

    def test_an_overload_without_a_body(self):
        self.assertEqual(self.with_engine("    void run();", "    void run();\n    void run(int turns);"),
                         ["engine/engine.h:13: Engine::run"])

    def test_what_is_pure_deleted_or_defaulted_needs_none(self):
        self.assertEqual(self.with_engine("    void run();", "    void run();\n    Engine() = default;\n"
                                          "    Engine(const Engine&) = delete;\n    virtual ~Engine() = default;"), [])


class NamesInProse(Case):
    def test_a_head_that_names_no_file(self):
        self.assertEqual(self.with_engine("engine/engine.cpp", "engine/motor.cpp"), ["engine/engine.h:1: engine/motor.cpp"])

    def test_a_head_that_names_no_function(self):
        self.assertEqual(self.with_engine("`Engine::run()`", "`Engine::walk()`"), ["engine/engine.h:1: Engine::walk()"])
        self.assertEqual(self.with_engine("`Engine::run()`", "walk()"), ["engine/engine.h:1: walk()"])

    def test_a_section_of_no_page_and_of_no_published_source(self):
        self.assertEqual(self.with_engine("is called by main", "(DESIGN §6)"), ["engine/engine.h:1: DESIGN §6"])
        self.assertEqual(self.with_engine("is called by main", "(RFC 9110 §12.5.3)"), [])

    def page(self, text, source):
        return self.found({"docs/use.md": text, "web/service.cpp": source})

    def test_flags(self):
        self.assertEqual(self.page("Say `toy --fast` or `toy --slow`.\n", 'const char* flag = "--fast";\n'),
                         ["docs/use.md:1: --slow"])

    def test_endpoints(self):
        routes = 'const char* routes[] = {"/api/jobs/*", "/api/files/*/start"};\n'
        self.assertEqual(self.page("`GET /api/jobs/ID`, `POST /api/files/NAME.gcode/start`, `GET /api/queue`.\n", routes),
                         ["docs/use.md:1: GET /api/queue"])

    def test_folders(self):
        self.assertEqual(self.page("`engine/oil/`, `apps/`, `text/plain`.\n", ""), ["docs/use.md:1: engine/oil/"])


class AllowList(Case):
    STOP = ENGINE_H.replace("    void run();", "    void run();\n    void stop() { turns_ = 0; }")

    def with_list(self, text):
        return self.found({"engine/engine.h": self.STOP}, text)

    def test_an_entry_leaves_what_it_names(self):
        self.assertEqual(self.with_list("dead engine/*.h Engine::stop  # wired next\n"), [])
        self.assertEqual(len(self.with_list("dead engine/*.h Engine::go  # wired next\n")), 2)

    def test_an_entry_without_a_reason(self):
        self.assertEqual(len(self.with_list("dead engine/engine.h Engine::stop\n")), 2)

    def test_a_name_that_matches_nothing(self):
        self.assertEqual(self.with_list("# a comment\n\ndead engine/*.h Engine::stop,Engine::go  # wired next\n"),
                         ["tools/dead/allowed.txt:3: nothing is found for 'dead engine/*.h Engine::go': take the entry out"])


if __name__ == "__main__":
    unittest.main()
