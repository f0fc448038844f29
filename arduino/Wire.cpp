#include "arduino/Wire.h"

#include <algorithm>

#include "arduino/core/diagnostics.h"
#include "board/board.h"

namespace board = qduino::board;
using qduino::ErrorCode;
using qduino::make_error;
using qduino::arduino::report_error;

TwoWire Wire QDUINO_BEFORE_SKETCH{0};
TwoWire Wire1 QDUINO_BEFORE_SKETCH{1};

namespace {

constexpr std::uint8_t kDone = 0, kTooLong = 1, kNoAnswer = 2, kOtherError = 4;

const qduino::Error kNotASlave =
    make_error(ErrorCode::unsupported, "this board is an I2C master; it cannot be addressed by another one");

}  // namespace

TwoWire::Transaction& TwoWire::mine() {
    const std::size_t self = board::current().current_vcpu();
    return transactions_[self < transactions_.size() ? self : 0];
}

void TwoWire::begin(int own_address) { report_error("Wire.begin", own_address, kNotASlave); }
void TwoWire::onReceive(void (*)(int)) { report_error("Wire.onReceive", bus_.number, kNotASlave); }
void TwoWire::onRequest(void (*)()) { report_error("Wire.onRequest", bus_.number, kNotASlave); }

void TwoWire::end() {
    Transaction& transaction = mine();
    send_kept(transaction);
    transaction = Transaction{};
}

std::uint8_t TwoWire::transfer(Transaction& transaction, std::size_t out_size, std::size_t in_size) {
    const qduino::arduino::LockGuard held{lock_};
    const auto done =
        board::current().i2c_transfer(bus_, board::I2cAddress{transaction.address},
                                      {transaction.out.data(), out_size}, {transaction.in.data(), in_size});
    transaction.in_read = 0;
    transaction.in_size = done.ok() ? in_size : 0;
    if (done.ok()) return kDone;
    // A scan of the bus asks every address: not worth a report.
    if (done.error().code == ErrorCode::timed_out) return kNoAnswer;
    report_error("Wire", transaction.address, done.error());
    return kOtherError;
}

void TwoWire::send_kept(Transaction& transaction) {
    if (!transaction.kept) return;
    transaction.kept = false;
    transfer(transaction, transaction.out_size, 0);
}

void TwoWire::beginTransmission(int address) {
    Transaction& transaction = mine();
    send_kept(transaction);
    transaction.address = static_cast<std::uint8_t>(address & 0x7f);
    transaction.out_size = 0;
    transaction.overflowed = false;
    transaction.collecting = true;
}

std::uint8_t TwoWire::endTransmission(bool stop) {
    Transaction& transaction = mine();
    transaction.collecting = false;
    if (transaction.overflowed) return kTooLong;
    if (stop) return transfer(transaction, transaction.out_size, 0);
    transaction.kept = true;
    return kDone;
}

std::size_t TwoWire::requestFrom(int address, std::size_t quantity, bool) {
    Transaction& transaction = mine();
    const auto wanted = static_cast<std::uint8_t>(address & 0x7f);
    if (transaction.kept && transaction.address != wanted) send_kept(transaction);
    const std::size_t out_size = transaction.kept ? transaction.out_size : 0;
    transaction.kept = false;
    transaction.address = wanted;
    transfer(transaction, out_size, std::min<std::size_t>(quantity, BUFFER_LENGTH));
    return transaction.in_size;
}

std::size_t TwoWire::requestFrom(int address, std::size_t quantity, std::uint32_t register_address,
                                 std::uint8_t register_size, bool stop) {
    beginTransmission(address);
    for (int byte_index = std::min<int>(register_size, 4) - 1; byte_index >= 0; --byte_index) {
        write(static_cast<std::uint8_t>(register_address >> (8 * byte_index)));
    }
    endTransmission(false);
    return requestFrom(address, quantity, stop);
}

std::size_t TwoWire::write(const std::uint8_t* buffer, std::size_t size) {
    Transaction& transaction = mine();
    if (!transaction.collecting) return 0;
    const std::size_t count = std::min(size, BUFFER_LENGTH - transaction.out_size);
    std::copy_n(buffer, count, transaction.out.begin() + static_cast<std::ptrdiff_t>(transaction.out_size));
    transaction.out_size += count;
    if (count < size) {
        transaction.overflowed = true;
        setWriteError();
    }
    return count;
}

int TwoWire::available() {
    const Transaction& transaction = mine();
    return static_cast<int>(transaction.in_size - transaction.in_read);
}
int TwoWire::peek() {
    const Transaction& transaction = mine();
    return transaction.in_read < transaction.in_size ? transaction.in[transaction.in_read] : -1;
}
int TwoWire::read() {
    const int value = peek();
    if (value >= 0) ++mine().in_read;
    return value;
}
