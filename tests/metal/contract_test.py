"""The contract of every board (tests/unit/board/board_contract.h), kept by the one without an operating system: each case in a boot of
its own, in an emulated machine of two cores whose time is a count of instructions.

  contract_test.py IMAGE      skipped, with exit status 77, when no emulator is installed"""
import shutil
import subprocess
import sys
import unittest

EMULATOR = 'qemu-system-x86_64'
IMAGE = sys.argv.pop(1)


# A sleep that is short by 5 us shows only where the way out of it, some 1,800 instructions, is
# shorter: there each is 1 ns, elsewhere 16.
EXACT = {'BusyUntilAndSleepUntilAreNeverEarly'}


def boot(words):
    """(status, what it said)."""
    shift = 0 if words.removeprefix('case=') in EXACT else 4
    machine = [EMULATOR, '-machine', 'q35', '-cpu', 'max', '-m', '128', '-smp', '2', '-display', 'none', '-nodefaults', '-no-reboot',
               '-kernel', IMAGE, '-append', words, '-icount', f'shift={shift},sleep=off', '-serial', 'stdio',
               '-device', 'isa-debug-exit,iobase=0xf4,iosize=0x01']
    done = subprocess.run(machine, stdin=subprocess.DEVNULL, capture_output=True, timeout=120, check=False)
    return done.returncode // 2, done.stdout.decode(errors='replace')


class Contract(unittest.TestCase):
    def test_every_case(self):
        status, names = boot('list')
        self.assertEqual(status, 0, names)
        self.assertGreater(len(names.split()), 25)
        for name in names.split():
            with self.subTest(name):
                self.assertEqual(boot('case=' + name), (0, 'passed\n'))

    def test_a_case_that_is_not_there_is_no_success(self):
        self.assertEqual(boot('case=Nobody')[0], 2)


if __name__ == '__main__':
    if not shutil.which(EMULATOR):
        print('skipped: no emulator. As root, run: apt-get install qemu-system-x86')
        sys.exit(77)
    unittest.main(verbosity=2)
