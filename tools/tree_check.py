"""What the checks of single files share: the list of files, the run over all of them, and the run of a check's own cases."""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def tracked_files(wanted):
    """The files of the tree, by path from its root, for which `wanted(path)` holds; what is somebody else's is left out."""
    listing = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [p for p in listing.stdout.splitlines() if wanted(p) and "/third_party/" not in p and (ROOT / p).is_file()]


def failed_cases(cases, clean, offences):
    """1 unless each case (path, text, part of the words) gives its offence, and nothing is left in `clean`."""
    failed = [c for c in cases if not any(c[2] in what for _, what in offences(c[0], c[1]))]
    for path, _, expected in failed:
        print(f"self-test: no offence '{expected}' found for {path}")
    if clean:
        print(f"self-test: clean text was blamed: {clean}")
    return 1 if failed or clean else 0


def run(name, wanted, offences, self_test):
    """The exit status of the check: of its own cases with --self-test, else of the tree."""
    if "--self-test" in sys.argv:
        return self_test()
    count = 0
    files = tracked_files(wanted)
    for path in files:
        for line, what in offences(path, (ROOT / path).read_text(encoding="utf-8")):
            print(f"{path}:{line}: {what}")
            count += 1
    print(f"{name}: {len(files)} files, {count} offences")
    return 1 if count else 0
