"""Every way from a firmware to an image, in QEMU with two and with four cores: PVH without any firmware, a CD by SeaBIOS, one program by
UEFI (OVMF); and by PVH on computers that differ. Each runs sketches/pulse_train, unchanged.

  boot_test.py QDUINO [Class.test]"""
import pathlib
import re
import subprocess
import unittest

from runs import CACHE, ENVIRONMENT, ROOT, Run, main, metal, missing

SKETCH = ROOT / 'sketches/pulse_train'
GRUB = {'grub_mkimage': 'grub-common'}
NEEDED = {'pvh': {}, 'bios': {**GRUB, 'xorriso': 'grub-pc-bin xorriso'}, 'uefi': GRUB}


class EveryWay(unittest.TestCase):
    def boots(self, way):
        if reason := missing(**NEEDED[way]):
            self.skipTest(reason)
        if way == 'uefi' and not pathlib.Path('/usr/share/ovmf/OVMF.fd').exists():
            self.skipTest('as root, run: apt-get install ovmf grub-efi-amd64-bin')
        for cores in 2, 4:
            with self.subTest(cores=cores):
                run = Run(SKETCH, '--for', '0.1', '--cores', cores, '--boot', way)
                self.assertEqual(run.status, 0, run.report)
                self.assertEqual(run.levels(6), [0] + [1, 0] * run.rises(6) + [0, 0])
                self.assertGreater(run.rises(6), 950)
                self.assertLess(run.rises(6), 1000)
                self.assertEqual(run.came_to(1), (0, 0), run.report)
                self.assertIn(f'  core {cores - 1}: ', run.report)
                self.assertNotIn(f'  core {cores}: ', run.report)

    def test_pvh(self):
        self.boots('pvh')

    def test_bios(self):
        self.boots('bios')

    def test_uefi(self):
        self.boots('uefi')


class OtherComputers(unittest.TestCase):
    """What firmware may tell, and what may be missing: the image finds its cores and its clock all the same."""

    def boots(self, cores, *machine):
        built = subprocess.run(metal('build', SKETCH), capture_output=True, text=True, timeout=200, check=True, env=ENVIRONMENT)
        record = pathlib.Path(CACHE) / 'pins'
        words = ['qemu-system-x86_64', '-display', 'none', '-nodefaults', '-no-reboot', '-icount', 'shift=4,sleep=off', '-kernel', built.stdout.strip(),
                 '-append', 'for=0.1', '-device', 'isa-debug-exit,iobase=0xf4,iosize=0x01', '-chardev', 'file,id=report,path=/dev/fd/2,append=on',
                 '-device', 'isa-debugcon,iobase=0xe9,chardev=report', '-chardev', f'file,id=pins,path={record}',
                 '-device', 'isa-debugcon,iobase=0x2e8,chardev=pins', *machine]
        done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=200, check=False)
        self.assertEqual(done.returncode, 1, done.stderr)  # 2 * 0 + 1
        self.assertIn(f'  core {cores - 1}: ', done.stderr)
        self.assertNotIn(f'  core {cores}: ', done.stderr)
        rises = record.read_bytes().count(0x86)
        self.assertGreater(rises, 950)
        self.assertLess(rises, 1000)
        # A pass of the kernel is so many instructions of 16 ns, if the clock is right.
        return [int(each) for each in re.findall(r'kernel (\d+) ns', done.stderr)]

    def test_cores_that_are_too_many_missing_or_numbered_with_gaps(self):
        for cores, smp in (8, '12'), (4, '4,maxcpus=8'), (6, '6,sockets=2,cores=3,threads=1'):
            self.boots(cores, '-smp', smp, '-machine', 'q35', '-cpu', 'max', '-m', '128')

    def test_more_memory_than_is_mapped(self):
        self.boots(2, '-smp', '2', '-machine', 'pc', '-cpu', 'qemu64', '-m', '6G')

    def test_a_clock_without_the_old_timer(self):
        with_it, without = (self.boots(2, '-smp', '2', '-machine', f'q35,pit={pit}', '-cpu', 'max', '-m', '128') for pit in ('on', 'off'))
        self.assertEqual(len(with_it), len(without))
        # Each core has two passes. One may take a branch more, by what it finds; a wrong clock
        # changes all of them.
        apart = [abs(one - other) / one for one, other in zip(with_it, without)]
        self.assertLess(min(apart), 0.002)
        self.assertLess(max(apart), 0.05)


class Media(unittest.TestCase):
    def made(self, action):
        if reason := missing(**NEEDED[{'iso': 'bios', 'efi': 'uefi'}[action]]):
            self.skipTest(reason)
        medium = pathlib.Path(CACHE) / f'a medium, {action}'
        done = subprocess.run(metal(action, SKETCH, '--for', '1', '-o', medium), capture_output=True, timeout=200, check=False, env=ENVIRONMENT)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.decode(), f'{medium}\n')
        return medium.read_bytes()

    def test_an_iso_is_one_that_boots(self):
        iso = self.made('iso')
        self.assertEqual(iso[0x8001:0x8006], b'CD001')
        self.assertIn(b'EL TORITO SPECIFICATION', iso[0x8800:0x9000])

    def test_an_efi_program_is_a_portable_executable(self):
        program = self.made('efi')
        self.assertEqual(program[:2], b'MZ')
        self.assertLess(len(program), 8_000_000)

    def test_what_an_emulator_has_not_is_refused(self):
        for options, words in ((['--witness', 'bochs', '--wire', 'w'], b'QEMU'), (['--vcd', 'v'], b'--witness bochs')):
            done = subprocess.run(metal('run', SKETCH, *options), capture_output=True, timeout=200, check=False, env=ENVIRONMENT)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(words, done.stderr)


if __name__ == '__main__':
    main(qemu_system_x86_64='qemu-system-x86')
