#include "board/linux/pin/bus_device.h"

#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/spi/spidev.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>

#include "board/linux/pin/smbus_request.h"
#include "posix/system_error.h"

namespace qduino::board::linux {

using posix::system_error;
using posix::UniqueFd;
namespace {

/// The kernel says "no such device" in several ways when nobody acknowledges an address.
Error bus_error(std::string_view bus, I2cAddress address, int error) {
    if (error == ENXIO || error == EREMOTEIO || error == ENODEV || error == EIO || error == ETIMEDOUT) {
        constexpr std::string_view kHex = "0123456789abcdef";
        return make_error(ErrorCode::timed_out, "no chip answers at address 0x",
                          kHex[(address.value >> 4) & 7], kHex[address.value & 15], " of ", bus,
                          ": check wiring and address");
    }
    return system_error("transfer on", bus, error);
}

}  // namespace

Result<void> I2cDevice::open(const I2cPort& port) {
    path_ = "/dev/i2c-" + std::to_string(port.adapter);
    fd_ = UniqueFd{::open(path_.c_str(), O_RDWR | O_CLOEXEC)};
    if (!fd_.valid()) return system_error("open", path_);
    unsigned long functions = 0;
    if (::ioctl(fd_.get(), I2C_FUNCS, &functions) != 0) return system_error("ask the abilities of", path_);
    smbus_only_ = (functions & I2C_FUNC_I2C) == 0;
    if (smbus_only_ && (functions & I2C_FUNC_SMBUS_READ_WORD_DATA) == 0) {
        return make_error(ErrorCode::unsupported,
                          "this I2C adapter speaks neither plain I2C nor SMBus words");
    }
    return {};
}

Result<void> I2cDevice::transfer(VcpuId, I2cBus, I2cAddress address, std::span<const std::uint8_t> out,
                                 std::span<std::uint8_t> in) {
    return smbus_only_ ? transfer_smbus(address, out, in) : transfer_messages(address, out, in);
}

Result<void> I2cDevice::transfer_messages(I2cAddress address, std::span<const std::uint8_t> out,
                                          std::span<std::uint8_t> in) {
    constexpr std::size_t kLongest = 8192;  // the kernel's own limit of one message
    if (out.size() > kLongest || in.size() > kLongest) {
        return make_error(ErrorCode::out_of_range, "an I2C message carries at most 8192 bytes: split it");
    }
    std::array<i2c_msg, 2> messages{};
    std::uint32_t count = 0;
    if (!out.empty() || in.empty()) {  // an empty transaction still asks whether a chip is there
        messages[count++] = {address.value, 0, static_cast<__u16>(out.size()), const_cast<__u8*>(out.data())};
    }
    if (!in.empty()) messages[count++] = {address.value, I2C_M_RD, static_cast<__u16>(in.size()), in.data()};
    i2c_rdwr_ioctl_data transaction{messages.data(), count};
    if (::ioctl(fd_.get(), I2C_RDWR, &transaction) >= 0) return {};
    return bus_error(path_, address, errno);
}

Result<void> I2cDevice::transfer_smbus(I2cAddress address, std::span<const std::uint8_t> out,
                                       std::span<std::uint8_t> in) {
    const auto request = smbus_request(out, in.size());
    if (!request) {
        return make_error(ErrorCode::unsupported,
                          "this adapter speaks SMBus only: one command byte and up to two of data");
    }
    if (::ioctl(fd_.get(), I2C_SLAVE, static_cast<unsigned long>(address.value)) != 0)
        return system_error("address a chip on", path_);
    i2c_smbus_data data{};
    if (request->size == I2C_SMBUS_WORD_DATA) data.word = request->data;
    if (request->size == I2C_SMBUS_BYTE_DATA) data.byte = static_cast<__u8>(request->data);
    i2c_smbus_ioctl_data order{static_cast<__u8>(request->direction), request->command, request->size, &data};
    if (::ioctl(fd_.get(), I2C_SMBUS, &order) < 0) return bus_error(path_, address, errno);
    if (in.size() == 1) in[0] = data.byte;
    if (in.size() == 2) {
        in[0] = static_cast<std::uint8_t>(data.word & 0xff);
        in[1] = static_cast<std::uint8_t>(data.word >> 8);
    }
    return {};
}

Result<void> SpiDevice::open(const SpiPort& port) {
    const auto path = text<std::string>("/dev/spidev", port.controller, '.', port.chip_select);
    fd_ = UniqueFd{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
    if (!fd_.valid()) return system_error("open", path);
    return {};
}

Result<void> SpiDevice::transfer(VcpuId, SpiBus, SpiSettings settings, std::span<std::uint8_t> data) {
    if (settings.mode > 3) return make_error(ErrorCode::invalid_argument, "an SPI mode is 0…3");
    __u32 mode = settings.mode;  // CPHA is bit 0, CPOL bit 1, as here
    if (settings.least_significant_first) mode |= SPI_LSB_FIRST;
    if (::ioctl(fd_.get(), SPI_IOC_WR_MODE32, &mode) != 0)
        return system_error("set the mode of", "the SPI device");
    spi_ioc_transfer transfer{};
    transfer.tx_buf = reinterpret_cast<std::uintptr_t>(data.data());
    transfer.rx_buf = transfer.tx_buf;
    transfer.len = static_cast<__u32>(data.size());
    transfer.speed_hz = settings.clock_hz;
    transfer.bits_per_word = 8;
    if (::ioctl(fd_.get(), SPI_IOC_MESSAGE(1), &transfer) < 0)
        return system_error("transfer on", "the SPI device");
    return {};
}

}  // namespace qduino::board::linux
