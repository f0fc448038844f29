"""A package of Debian for another architecture, without installing it.

apt works in a folder of its own, for one processor architecture at a time: what is installed, which architectures there are and
which lists have been fetched on this machine stays as it is. The sources, their keys and proxies are the machine's.

  foreign_package.py ARCHITECTURE PACKAGE FOLDER FILE…      its files that match (./usr/…, with wildcards), into a folder, without
                                                            their own folders
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile


class NotToBeHad(Exception):
    """The package cannot be fetched here; the text says why."""


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


def fetch(architecture, name_of_package, patterns, final):
    """`name_of_package(state)` is asked when the lists are there. Returns the folder `final`, with what matches, and `name`."""
    final.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=final.parent, prefix='apt-') as folder:
        state = pathlib.Path(folder)
        apt(architecture, state, 'apt-get', 'update')
        name = name_of_package(state)
        apt(architecture, state, 'apt-get', 'download', name)
        target = state / 'unpacked'
        target.mkdir()
        unpack(next(state.glob(f'{name}_*.deb')), patterns, target)
        (target / 'name').write_text(name + '\n')
        shutil.rmtree(final, ignore_errors=True)
        target.rename(final)
    return final


if __name__ == '__main__':
    try:
        fetch(sys.argv[1], lambda _: sys.argv[2], sys.argv[4:], pathlib.Path(sys.argv[3]).absolute())
    except NotToBeHad as why:
        sys.exit(f'foreign_package.py: {why}')
