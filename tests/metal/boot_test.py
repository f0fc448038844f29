"""Every way from a firmware to an image, in QEMU with two and with four cores: PVH without any firmware, a CD by SeaBIOS, one program by
UEFI (OVMF). Each runs sketches/pulse_train, unchanged.

  boot_test.py QDUINO [Class.test]"""
import pathlib
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
