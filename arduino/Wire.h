// Wire: an I2C master, over the board's bus.
//
// Arduino's calls collect one transaction. The board gets it whole, so that nothing comes between a
// register address and the bytes read from there:
//
//   beginTransmission(a) write(r) endTransmission(false) requestFrom(a, n)   r out, n in, at once
//   beginTransmission(a) write(…) endTransmission()                          … out
//   requestFrom(a, n)                                                        n in
//
// Each loop has buffers of its own, so several loops collect their transactions side by side. The
// bus takes one at a time, whole. A loop that waits for the bus lends its rank to the loop whose
// transaction is on it (core/lock.h). No allocation.
#pragma once

#include <array>
#include <cstdint>

#include "arduino/Stream.h"
#include "arduino/core/lock.h"
#include "board/types.h"

#define BUFFER_LENGTH 256  // 32 on the AVR; libraries compare it in #if
#define I2C_BUFFER_LENGTH BUFFER_LENGTH
#define WIRE_HAS_END 1
#define WIRE_HAS_TIMEOUT 1

/// Say in setup() which loops use the bus, and how long each transaction takes: Wire.heldBy(3,
/// 1ms). If nothing is said of a bus, admission assumes that every loop of a core holds it for
/// kUsualBytes at a time.
class TwoWire : public Stream, public qduino::arduino::SaysWhoHolds<TwoWire> {
  public:
    /// The address, and an AVR's two buffers: 32 bytes out, 32 in.
    static constexpr std::size_t kUsualBytes = 65;

    /// Bus `number` of the board.
    explicit TwoWire(std::uint8_t number)
        : bus_{number}, lock_(number == 0 ? "Wire" : "Wire1", qduino::board::DeviceClass::i2c, kUsualBytes) {}

    void begin() { qduino::arduino::declare_use(lock_); }
    /// This board is a master only. A call with an own address is reported as an error, and changes
    /// nothing.
    void begin(int own_address);
    void end();
    /// The bus's speed is the board's. Admission takes this one for it where the board does not
    /// say.
    void setClock(std::uint32_t hz) { lock_.declaration().set_clock(hz); }
    /// The board has its own timeout; accepted and ignored.
    void setWireTimeout(std::uint32_t = 25000, bool = false) {}
    /// Whether a bus that somebody held low was given up: never here. A chip that does not answer
    /// is another matter (endTransmission() is 2).
    [[nodiscard]] bool getWireTimeoutFlag() const { return false; }
    void clearWireTimeoutFlag() {}

    void beginTransmission(int address);
    /// 0: done (or, with `stop` false, kept for the requestFrom that follows); 1: too long for the
    /// buffer; 2: no chip answers; 4: another error, which is reported.
    std::uint8_t endTransmission(bool stop = true);
    /// Reads `quantity` bytes (at most BUFFER_LENGTH) into the calling loop's buffer; returns how
    /// many came, 0 on an error.
    std::size_t requestFrom(int address, std::size_t quantity, bool stop = true);
    /// Writes the register address first (`register_size` bytes, highest first), in the same
    /// transaction.
    std::size_t requestFrom(int address, std::size_t quantity, std::uint32_t register_address,
                            std::uint8_t register_size, bool stop);

    /// Only within beginTransmission … endTransmission; 0 when the buffer is full.
    std::size_t write(std::uint8_t value) override { return write(&value, 1); }
    std::size_t write(const std::uint8_t* buffer, std::size_t size) override;
    template <typename T>
    requires std::is_integral_v<T> std::size_t write(T value) {
        return write(static_cast<std::uint8_t>(value));
    }
    using Print::write;

    int available() override;
    int read() override;
    int peek() override;

    void onReceive(void (*handler)(int));
    void onRequest(void (*handler)());

  private:
    /// One loop's transaction in the making.
    struct Transaction {
        std::array<std::uint8_t, BUFFER_LENGTH> out{};
        std::array<std::uint8_t, BUFFER_LENGTH> in{};
        std::size_t out_size = 0;
        std::size_t in_size = 0;
        std::size_t in_read = 0;
        std::uint8_t address = 0;
        bool collecting = false;  ///< between beginTransmission and endTransmission
        bool kept = false;        ///< endTransmission(false): out waits for its requestFrom
        bool overflowed = false;
    };
    Transaction& mine();
    /// Sends a transaction that endTransmission(false) kept and no requestFrom followed.
    void send_kept(Transaction& transaction);
    std::uint8_t transfer(Transaction& transaction, std::size_t out_size, std::size_t in_size);

    friend class qduino::arduino::SaysWhoHolds<TwoWire>;

    qduino::board::I2cBus bus_;
    qduino::arduino::Lock lock_;  // held for a transaction
    std::array<Transaction, qduino::board::kVcpuLimit> transactions_{};
};

extern TwoWire Wire;
extern TwoWire Wire1;

namespace arduino {
using ::TwoWire;
}  // namespace arduino
