// A process tree in a VCPU; then the sketch adc/ on /dev/i2c-0, and then the doctor.
//
// On that bus the kernel's i2c-stub plays a chip: what the ADS7828 would answer to each command is
// put into the stub first, past the board. The readings come from outside: "adc=291,1023,…" on the
// kernel's command line. The stub keeps a 16-bit word per command byte. SMBus sends the low byte of
// a word first, the ADS7828 the high byte.
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "device/ads7828.h"
#include "doctor/doctor.h"
#include "tests/emulated/guest/guest_init.h"
#include "tests/emulated/guest/run_sketch.h"
#include "tests/emulated/guest/run_spinners.h"

namespace {

using namespace qduino;

bool put_word(int bus, std::uint8_t command, unsigned reading) {
    i2c_smbus_data data{};
    data.word = static_cast<__u16>((reading >> 8) | ((reading & 0xff) << 8));
    i2c_smbus_ioctl_data request{I2C_SMBUS_WRITE, command, I2C_SMBUS_WORD_DATA, &data};
    return ::ioctl(bus, I2C_SMBUS, &request) == 0;
}

/// The readings of channels 0…7 into the stub. False: it could not be done.
bool fill_stub() {
    const char* readings = std::getenv("adc");
    const int bus = ::open("/dev/i2c-0", O_RDWR | O_CLOEXEC);
    bool done = readings && ::ioctl(bus, I2C_SLAVE, device::ads7828::kFirstAddress) == 0;
    for (int channel = 0; done && channel < device::ads7828::kChannelCount; ++channel) {
        char* end = nullptr;
        const unsigned long reading = std::strtoul(readings, &end, 10);
        done = end != readings &&
               put_word(bus, device::ads7828::command_byte(channel), static_cast<unsigned>(reading));
        readings = *end == ',' ? end + 1 : end;
    }
    ::close(bus);
    return done;
}

}  // namespace

int main(int argc, char** argv) {
    if (emulated::is_spinner(argc, argv)) return 0;
    return emulated::run_as_init([] {
        if (emulated::run_spinners() != 0) return 2;
        if (!fill_stub()) {
            std::perror("emulated: no i2c-stub to fill at /dev/i2c-0");
            return 2;
        }
        board::linux::LinuxConfig config;
        config.i2c.push_back({board::I2cBus{0}, 0});
        config.isolate = true;
        const int result = emulated::run_sketch(std::move(config), std::chrono::seconds{120});
        std::puts("doctor: begins");
        apps::run_doctor({.json = true, .root = ""}, stdout);
        std::puts("doctor: ends");
        return result;
    });
}
