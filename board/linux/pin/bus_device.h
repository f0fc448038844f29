// Real buses: /dev/i2c-N and /dev/spidevB.C, through the kernel's ioctls. Each transaction is one
// ioctl, which the kernel makes atomic on its bus: so several loops may share a bus.
#pragma once

#include <string>

#include "board/linux/kernel/linux_config.h"
#include "board/linux/pin/pin_driver.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

class I2cDevice final : public I2cDriver {
  public:
    /// Error: not_found, not_permitted; unsupported when the adapter cannot do plain I2C or SMBus
    /// word reads.
    Result<void> open(const I2cPort& port);
    /// Writes `out`, then, after a repeated start, reads `in`. Blocks for the duration on the bus.
    /// An adapter that only speaks SMBus carries what smbus_request.h can translate; the rest is
    /// unsupported. Error: timed_out when no chip answers.
    Result<void> transfer(VcpuId vcpu, I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                          std::span<std::uint8_t> in) override;

  private:
    Result<void> transfer_messages(I2cAddress address, std::span<const std::uint8_t> out,
                                   std::span<std::uint8_t> in);
    Result<void> transfer_smbus(I2cAddress address, std::span<const std::uint8_t> out,
                                std::span<std::uint8_t> in);

    posix::UniqueFd fd_;
    std::string path_;
    bool smbus_only_ = false;
};

class SpiDevice final : public SpiDriver {
  public:
    /// Error: not_found, not_permitted.
    Result<void> open(const SpiPort& port);
    Result<void> transfer(VcpuId vcpu, SpiBus bus, SpiSettings settings,
                          std::span<std::uint8_t> data) override;

  private:
    posix::UniqueFd fd_;
};

}  // namespace qduino::board::linux
