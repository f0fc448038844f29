"""What a library asks of its surroundings: fails, by name, on anything but the project's own symbols and what every compiler's
freestanding runtime has. `needed_symbols.py NM LIBRARY`."""
import subprocess
import sys

# The symbols of the compiler's own runtime, and the four functions that a freestanding GCC may call
# for copies.
RUNTIME = {"memcpy", "memmove", "memset", "memcmp", "__divti3", "__udivti3", "__modti3", "__umodti3", "__multi3", "_GLOBAL_OFFSET_TABLE_",
           "abort", "__stack_chk_fail"}


def main():
    lines = subprocess.run([sys.argv[1], "-u", sys.argv[2]], capture_output=True, text=True, check=True).stdout.splitlines()
    needed = {line.split()[-1] for line in lines if line.strip() and not line.endswith(":")}
    foreign = sorted(name for name in needed - RUNTIME if "6qduino" not in name)
    for name in foreign:
        print(f"needs {name}: sched/ is to run without a C++ library, a heap or an operating system")
    print(f"{len(needed)} symbols needed, {len(foreign)} of them foreign")
    return 1 if foreign or not needed else 0


if __name__ == "__main__":
    sys.exit(main())
