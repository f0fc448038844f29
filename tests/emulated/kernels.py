"""Debian's real-time kernels, out of its archive and into a cache, without installing them.

apt works in a folder of its own, for one processor architecture at a time: what is installed, which architectures there are and
which lists have been fetched on this machine stays as it is. The sources, their keys and proxies are the machine's.
"""
import pathlib
import re
import shutil
import subprocess
import tempfile


class NotToBeHad(Exception):
    """The kernel cannot be fetched here; the text says why."""


# What each machine needs of its package; the rest (some 300 MB) is left packed.
WANTED = {
    'arm64': ['./boot/vmlinuz-*'],
    'amd64': ['./boot/vmlinuz-*', './lib/modules/*/i2c-dev.ko*', './lib/modules/*/i2c-stub.ko*'],
}


def apt(architecture, state, *command):
    """Runs one command of apt, in `state`; returns what it printed."""
    for folder in ('lists/partial', 'archives/partial'):
        (state / folder).mkdir(parents=True, exist_ok=True)
    (state / 'status').touch()
    options = [f'Dir::State={state}', f'Dir::State::status={state}/status', f'Dir::Cache={state}',
               f'APT::Architecture={architecture}', 'APT::Architectures=', f'APT::Architectures::={architecture}',
               'APT::Sandbox::User=root', 'Acquire::Languages=none', 'Acquire::Retries=2']
    line = [command[0], '-qq', *(word for option in options for word in ('-o', option)), *command[1:]]
    ran = subprocess.run(line, cwd=state, capture_output=True, text=True)
    if ran.returncode != 0:
        raise NotToBeHad(f'{" ".join(command)} ({architecture}): {ran.stderr.strip() or "failed"}')
    return ran.stdout


def unpack(package, patterns, folder):
    """The files of a .deb that match, without their folders."""
    packed = subprocess.Popen(['dpkg-deb', '--fsys-tarfile', package], stdout=subprocess.PIPE)
    subprocess.run(['tar', '-x', '-C', folder, '--wildcards', '--transform=s|.*/||', *patterns], stdin=packed.stdout, check=True)
    packed.stdout.close()
    packed.wait()


def fetch(architecture, cache):
    meta = f'linux-image-rt-{architecture}'
    with tempfile.TemporaryDirectory(dir=cache, prefix='apt-') as folder:
        state = pathlib.Path(folder)
        apt(architecture, state, 'apt-get', 'update')
        depends = apt(architecture, state, 'apt-cache', 'depends', meta)
        named = re.search(r'Depends: (linux-image-\S+)', depends)
        if not named:
            raise NotToBeHad(f'{meta} is in none of the sources of this machine (Debian has it)')
        apt(architecture, state, 'apt-get', 'download', named[1])
        target = state / 'unpacked'
        target.mkdir()
        unpack(next(state.glob('linux-image-*.deb')), WANTED[architecture], target)
        (target / 'name').write_text(named[1] + '\n')
        final = cache / f'kernel-{architecture}'
        shutil.rmtree(final, ignore_errors=True)
        target.rename(final)
        return final


def kernel(architecture, cache, fresh=False):
    """The folder with vmlinuz-*, the modules and `name`: from the cache, or fetched. Raises NotToBeHad."""
    cached = cache / f'kernel-{architecture}'
    if (cached / 'name').exists() and not fresh:
        return cached
    cache.mkdir(parents=True, exist_ok=True)
    return fetch(architecture, cache)
