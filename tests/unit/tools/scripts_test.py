"""What ./run, ./install and ./test say of themselves, and to whoever calls them wrongly: it fits 80 columns, and names the option."""

import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCRIPTS = ["run", "install", "test"]


def call(script, *arguments):
    """(status, what it said); it ends before it does anything."""
    done = subprocess.run([str(ROOT / script), *arguments], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=60, check=False)
    return done.returncode, done.stdout


class Scripts(unittest.TestCase):
    def assert_fits(self, text):
        for line in text.splitlines():
            self.assertLessEqual(len(line), 80, line)

    def test_the_help_fits_a_terminal(self):
        for script in SCRIPTS:
            status, said = call(script, "--help")
            self.assertEqual(status, 0, said)
            self.assertIn("./" + script, said)
            self.assert_fits(said)

    def test_an_option_without_its_value_is_named(self):
        options = {"install": ["--prefix"], "test": ["-R"]}
        options["run"] = re.findall(r"^  (--[\w-]+) (?:[A-Z]+|pty) ", call("run", "--help")[1], re.M)
        self.assertGreater(len(options["run"]), 12, "the help has them all")
        for script, names in options.items():
            for name in names:
                status, said = call(script, name)
                self.assertNotEqual(status, 0)
                self.assertRegex(said, r"\A%s: %s needs .+\n\Z" % (script, name))

    def test_an_option_that_does_not_exist_is_named(self):
        for script in SCRIPTS:
            status, said = call(script, "--prot")
            self.assertNotEqual(status, 0)
            self.assertEqual(said, "%s: there is no option --prot; './%s --help' shows what there is\n" % (script, script))

    def test_a_name_that_is_none_is_refused_by_the_option_that_was_typed(self):
        for name in ("bad_name!", "a.b", "a-", "n" * 64):
            status, said = call("run", "--lan", name)
            self.assertNotEqual(status, 0)
            self.assertEqual(said, "run: --lan takes letters, digits and hyphens as a name, not '%s'\n" % name)

    def test_what_does_not_go_together_is_said_in_lines_that_fit(self):
        for wrong in (["--metal", "--speed", "2"], ["--port", "99999"]):
            status, said = call("run", *wrong)
            self.assertNotEqual(status, 0)
            self.assertRegex(said, r"\Arun: " + wrong[0])
            self.assert_fits(said)


if __name__ == "__main__":
    unittest.main()
