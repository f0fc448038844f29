# The packages that the project needs from Debian, by purpose, and their installation. Sourced by
# ./run and ./test.
#
#   need build web …     installs what is missing of these sets; without root it lists what to
#                        install and stops

packages_build="g++ cmake ninja-build pkg-config python3 git ca-certificates
  libboost1.81-dev libssl-dev nlohmann-json3-dev libcli11-dev libtomlplusplus-dev libsqlite3-dev libsqlitecpp-dev
  libsodium-dev libcap-dev libseccomp-dev libqrencode-dev libavahi-core-dev libpng-dev libspdlog-dev prometheus-cpp-dev libbenchmark-dev
  libgtest-dev libgmock-dev librapidcheck-dev"
packages_web="nodejs npm"
packages_run="curl util-linux"
packages_metal="musl-dev qemu-system-x86 ovmf grub-common grub-pc-bin grub-efi-amd64-bin xorriso
  bochs bochs-term bochsbios vgabios"
packages_emulated="qemu-system-arm qemu-system-x86 g++-aarch64-linux-gnu"
packages_test="clang-14 libclang-rt-14-dev clang-format-14 lld universal-ctags chromium curl jq procps util-linux iproute2 dnsmasq-base zbar-tools python3-zeroconf openssl libfaketime
  arduino-builder arduino-core-avr gcc-avr avr-libc simavr"

# Debian's nodejs (18) is too old for the page's build tools only where it is older than this.
node_major_minimum=18

say() { printf '%s\n' "$*" >&2; }

# Prints the comment at the head of the script that runs: its help, 80 columns wide.
usage() { sed -n '/^#!/d; /^#/!q; s/^# \{0,1\}//p' "$0"; }

# Ends the script where the option NAME, which needs WHAT, was given without a value.
needs_value() {  # NAME WHAT VALUE
  [ -n "$3" ] || { say "${0##*/}: $1 needs $2"; exit 1; }
}

# Prints those of its arguments that are not installed.
missing_packages() {
  local package
  for package in "$@"; do
    case "$package" in
      nodejs) node_is_new_enough && continue ;;
      npm) command -v npm >/dev/null && continue ;;
    esac
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q '^install ok installed' || printf '%s ' "$package"
  done
}

node_is_new_enough() {
  command -v node >/dev/null && [ "$(node -p 'process.versions.node.split(".")[0]')" -ge "$node_major_minimum" ]
}

need() {
  local set wanted="" missing as_root=""
  for set in "$@"; do
    local name="packages_$set"
    wanted="$wanted ${!name}"
  done
  command -v dpkg-query >/dev/null || { say "This is not a Debian system: install by hand:$wanted"; return 0; }
  # shellcheck disable=SC2086
  missing=$(missing_packages $wanted)
  [ -z "$missing" ] && return 0
  if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo >/dev/null && sudo -n true 2>/dev/null; then as_root="sudo"; else
      say "Missing packages. As root, run:  apt-get install $missing"
      return 1
    fi
  fi
  say "Installing: $missing"
  # shellcheck disable=SC2086
  $as_root env DEBIAN_FRONTEND=noninteractive sh -c \
    'apt-get -qq update && apt-get -qq -y --no-install-recommends install "$@" >/dev/null' sh $missing
}

# ctest, which ends when this script ends, however that does: its tests take cores of the computer.
# (setpriv is util-linux's.)
run_ctest() { setpriv --pdeathsig KILL ctest "$@"; }

# Unpacks the examples of Debian's `arduino` package into build/arduino. The package is not
# installed: it would bring a Java along.
unpack_arduino_examples() {
  [ ! -d build/arduino/usr ] && [ ! -d /usr/share/arduino/examples ] && command -v dpkg-deb >/dev/null || return 0
  mkdir -p build/arduino && (
    cd build/arduino && apt-get -qq download arduino >/dev/null 2>&1 && dpkg-deb -x arduino_*.deb . && rm -f arduino_*.deb
  ) || say "Debian's arduino package could not be fetched: its examples are skipped"
}

# Unpacks printcore, the serial host of Debian's `printrun`. Installed, its packages would bring a
# whole desktop along.
unpack_printrun() { unpack_for_tests printrun printrun-common python3-serial; }

# Unpacks packages that a test uses, into build/FOLDER. They are not installed: a server would
# start.
unpack_for_tests() {  # FOLDER PACKAGE…
  local folder=$1; shift
  [ ! -d "build/$folder/usr" ] && command -v dpkg-deb >/dev/null || return 0
  mkdir -p "build/$folder" && (
    cd "build/$folder" && apt-get -qq download "$@" >/dev/null 2>&1 &&
      for package in *.deb; do dpkg-deb -x "$package" . && rm -f "$package" || exit 1; done
  ) || say "Debian's $* could not be fetched: the tests with it are skipped"
}

# The Arduino IDE's builder, without the IDE.
unpack_arduino_builder() { unpack_for_tests arduino-builder arduino-builder arduino-ctags; }

# The Arduino IDE 1.8 with its libraries, and an X server without a screen. Java is not among them.
unpack_arduino_ide() {
  # shellcheck disable=SC2046
  unpack_for_tests arduino-ide arduino arduino-builder arduino-core-avr arduino-ctags libastylej-jni librxtx-java \
    liblistserialsj1 liblistserialsj-dev libserialport0 xvfb libxfont2 x11-xkb-utils xserver-common xkb-data \
    $(printf 'lib%s-java ' jaxp1.3 xml-commons-external commons-logging xmlgraphics-commons batik bcprov bcpg \
        commons-codec commons-compress commons-exec commons-io commons-lang3 commons-net httpcore httpclient \
        jackson2-annotations jackson2-core jackson2-databind jmdns jna jna-platform jzlib jsch jssc log4j2 \
        rsyntaxtextarea semver slf4j) libjna-jni
}

# A server for ssh, which a test runs at a port of its own.
unpack_sshd() { unpack_for_tests openssh openssh-server libwrap0; }

# The proxies that may stand in front of the printer (docs/reach.md).
unpack_proxies() { unpack_for_tests proxies nginx haproxy caddy liblua5.3-0 libopentracing-c-wrapper0 libopentracing1; }

# Firmata's library for Arduino and its reference client, for the test in tests/e2e/firmata.
fetch_firmata() {
  [ ! -e tests/e2e/firmata/node_modules/.installed ] && command -v npm >/dev/null || return 0
  (cd tests/e2e/firmata && npm ci --no-audit --no-fund --loglevel=error >/dev/null 2>&1 && touch node_modules/.installed) ||
    say "Firmata could not be fetched: the test with it is skipped"
}
