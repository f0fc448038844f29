#include "qduino/beside_command.h"

#include <string_view>

#include "beside/beside_run.h"
#include "posix/small_file.h"
#include "qduino/metal_command.h"
#include "qduino/trace/pin_record.h"
#include "report/pin/pin_witness.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// The pins of a run beside Linux, where no other program plays what is wired to them.
class CountedPins final : public board::NoPeripherals {
  public:
    void pin_written(Instant, board::PinId pin, board::Level level) override {
        tally_.note(pin.number, level == board::Level::high);
    }
    [[nodiscard]] std::string table() const { return tally_.table(); }

  private:
    PinTally tally_;
};

}  // namespace

Result<int> run_beside_linux(const Arguments& arguments, const fs::path& image, const std::string& name) {
    QDUINO_TRY_ASSIGN(const std::string bytes, posix::read_small_file(image));
    CountedPins pins;
    PinWitness witness;
    witness.forward_to(pins);
    if (!arguments.vcd.empty()) QDUINO_TRY(witness.keep_dump());
    const beside_linux::BesideOptions options{.core = arguments.core.value_or(1),
                                              .silence = from_seconds(arguments.silence_ms / 1000),
                                              .words = image_words(arguments),
                                              .link = arguments.link};
    QDUINO_TRY_ASSIGN(
        const int status,
        beside_linux::run_beside({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, options,
                                 witness));
    say(pins.table());
    say(witness.sentences());
    if (!arguments.vcd.empty()) QDUINO_TRY(witness.write_dump(arguments.vcd));
    say(verdict(status == 0   ? name + " ran to its end, and Linux has its core back."
                : status == 2 ? name + " is REFUSED: no loop of it ran. Linux has its core back."
                : status == 3 ? name + " was ENDED, for Linux was silent. It has its core back."
                              : name + " FAILED. Linux has its core back."));
    return status == 3 ? 1 : status;
}

}  // namespace qduino::apps
