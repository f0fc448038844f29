// SPI: a master, over the board's bus.
//
// beginTransaction() … endTransaction() hold the bus for the calling loop. So a chip's select pin
// and its bytes stay together when several loops share the bus. transfer() alone holds the bus for
// itself. No allocation.
#pragma once

#include <cstddef>
#include <cstdint>

#include "arduino/core/constants.h"
#include "arduino/core/lock.h"
#include "board/types.h"

// Libraries ask for these before they use beginTransaction() or notUsingInterrupt(): without them
// they take the way of 2013, on which nothing keeps a transaction whole.
#define SPI_HAS_TRANSACTION 1
#define SPI_HAS_NOTUSINGINTERRUPT 1
#define SPI_ATOMIC_VERSION 1

inline constexpr std::uint8_t SPI_MODE0 = 0, SPI_MODE1 = 1, SPI_MODE2 = 2, SPI_MODE3 = 3;
#define SPI_MODE0 SPI_MODE0
#define SPI_MODE1 SPI_MODE1
#define SPI_MODE2 SPI_MODE2
#define SPI_MODE3 SPI_MODE3
// Divisors of the Uno's 16 MHz, for setClockDivider().
inline constexpr std::uint8_t SPI_CLOCK_DIV2 = 2, SPI_CLOCK_DIV4 = 4, SPI_CLOCK_DIV8 = 8,
                              SPI_CLOCK_DIV16 = 16, SPI_CLOCK_DIV32 = 32, SPI_CLOCK_DIV64 = 64,
                              SPI_CLOCK_DIV128 = 128;
#define SPI_CLOCK_DIV2 SPI_CLOCK_DIV2
#define SPI_CLOCK_DIV4 SPI_CLOCK_DIV4
#define SPI_CLOCK_DIV8 SPI_CLOCK_DIV8
#define SPI_CLOCK_DIV16 SPI_CLOCK_DIV16
#define SPI_CLOCK_DIV32 SPI_CLOCK_DIV32
#define SPI_CLOCK_DIV64 SPI_CLOCK_DIV64
#define SPI_CLOCK_DIV128 SPI_CLOCK_DIV128

class SPISettings {
  public:
    SPISettings(std::uint32_t clock_hz = 4'000'000, BitOrder order = MSBFIRST, std::uint8_t mode = SPI_MODE0)
        : settings_{clock_hz, static_cast<std::uint8_t>(mode & 3), order == LSBFIRST} {}
    [[nodiscard]] const qduino::board::SpiSettings& get() const { return settings_; }

  private:
    qduino::board::SpiSettings settings_;
};

/// Say in setup() which loops hold the bus, and how long: SPI.heldBy(1, 2ms). A bus that says
/// nothing may be held by every loop of a core for its whole budget, as far as admission knows:
/// what stands between beginTransaction() and endTransaction() is the sketch's.
class SPIClass : public qduino::arduino::SaysWhoHolds<SPIClass> {
  public:
    explicit SPIClass(std::uint8_t number) : bus_{number}, lock_(number == 0 ? "SPI" : "SPI1", kUnsaid) {}

    void begin() { qduino::arduino::declare_use(lock_); }
    void end() {}
    void beginTransaction(const SPISettings& settings);
    void endTransaction() { lock_.unlock(); }

    /// One byte out, and the one that came in. 0xff, reported, when the board's bus fails.
    std::uint8_t transfer(std::uint8_t value);
    /// Two bytes, in the order of the settings.
    std::uint16_t transfer16(std::uint16_t value);
    /// In place: what came in replaces what went out.
    void transfer(void* buffer, std::size_t size);

    /// Interrupt handlers are threads here; they take the bus like any loop.
    void usingInterrupt(int) {}
    void notUsingInterrupt(int) {}
    /// No interrupt tells the end of a transfer: transfer() waits for it.
    void attachInterrupt() {}
    void detachInterrupt() {}

    // ---- from before transactions: the settings that hold outside of them -----------------------
    void setBitOrder(BitOrder order) { settings_.least_significant_first = order == LSBFIRST; }
    void setDataMode(std::uint8_t mode) { settings_.mode = mode & 3; }
    void setClockDivider(std::uint8_t divider);

  private:
    friend class qduino::arduino::SaysWhoHolds<SPIClass>;
    static constexpr auto kUnsaid = qduino::runtime::Unsaid::whole_budgets_nearby;

    qduino::board::SpiBus bus_;
    qduino::arduino::Lock lock_;
    qduino::board::SpiSettings settings_;
};

extern SPIClass SPI;
extern SPIClass SPI1;

namespace arduino {
using ::SPIClass;
using ::SPISettings;
}  // namespace arduino
