#include "beside/given_core.h"

#include <fcntl.h>
#include <sched.h>

#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include "base/parts.h"
#include "base/text.h"
#include "base/whole_number.h"
#include "beside/boot_line.h"
#include "board/linux/kernel/kernel_text.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "terminal/message.h"

namespace qduino::apps::beside_linux {
namespace {

using board::linux::text_of_file;
using board::linux::trimmed;

std::string online_file(int core) {
    return text<std::string>("/sys/devices/system/cpu/cpu", core, "/online");
}

/// The local APIC's number of a core that is on, from /proc/cpuinfo.
std::optional<std::uint32_t> apic_number_of(int core) {
    const std::string facts = text_of_file("/proc/cpuinfo");
    int at = -1;
    for (const std::string_view line : parts(facts, "\n")) {
        const std::size_t colon = line.find(':');
        if (colon == std::string_view::npos || colon + 2 > line.size()) continue;
        const std::string_view name = trimmed(line.substr(0, colon)), value = line.substr(colon + 2);
        if (name == "processor") at = whole_number<int>(value).value_or(-1);
        if (name == "apicid" && at == core) return whole_number<std::uint32_t>(value);
    }
    return std::nullopt;
}

void wait_us(int length) { std::this_thread::sleep_for(std::chrono::microseconds{length}); }

}  // namespace

// ---- the local APIC -----------------------------------------------------------------------------

Result<LocalApicPage> LocalApicPage::open(int cpu, std::uint32_t apic_number) {
    constexpr std::size_t kAt = 0xfee00000;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(cpu), &one);
    if (::sched_setaffinity(0, sizeof one, &one) != 0)
        return posix::system_error("stay on", text("core ", cpu).view());
    const posix::UniqueFd memory{::open("/dev/mem", O_RDWR | O_SYNC | O_CLOEXEC)};
    if (!memory.valid()) return posix::system_error("open", "/dev/mem");
    LocalApicPage page;
    QDUINO_TRY_ASSIGN(page.page_, posix::map_shared(memory.get(), kAt, kPage, false));
    constexpr std::size_t kNumber = 0x20;
    if (page.page_.as<volatile std::uint32_t>()[kNumber / 4] >> 24 != apic_number)
        return make_error(ErrorCode::unsupported,
                          "Linux does not use the local APIC by its memory: boot with nox2apic");
    return page;
}

void LocalApicPage::command(std::uint32_t apic, std::uint32_t word) {
    constexpr std::size_t kCommand = 0x300 / 4, kCommandHigh = 0x310 / 4;
    constexpr std::uint32_t kPending = 0x1000;
    auto* const registers = page_.as<volatile std::uint32_t>();
    while ((registers[kCommand] & kPending) != 0) {
    }
    do {
        registers[kCommandHigh] = apic << 24;
    } while (registers[kCommandHigh] != apic << 24);
    registers[kCommand] = word;
}

void LocalApicPage::park(std::uint32_t apic) {
    constexpr std::uint32_t kInit = 0x4500;
    command(apic, kInit);
    wait_us(10'000);
}

void LocalApicPage::start(std::uint32_t apic, std::uint32_t page) {
    constexpr std::uint32_t kStartup = 0x4600;
    park(apic);
    for (int i = 0; i < 2; ++i) {
        command(apic, kStartup | page / kPage);
        wait_us(200);
    }
}

// ---- the core -----------------------------------------------------------------------------------

Result<GivenCore> GivenCore::take(int core) {
    constexpr int kKeepers = 0;  // core 0 stays Linux's
    const std::string file = online_file(core);
    const std::string online = text_of_file(file);
    if (core < 1 || core > 7 || online.empty())
        return make_error(ErrorCode::not_found, "Linux does not give core ", core,
                          " up: it is one of 1 to 7 that has a file ", file);
    QDUINO_TRY_ASSIGN(board::linux::CoreLock lock, board::linux::CoreLock::take(core, Nanoseconds{0}));
    if (online == "0") QDUINO_TRY(posix::write_small_file(file, "1"));
    const auto apic = apic_number_of(core), own = apic_number_of(kKeepers);
    if (!apic || !own) return make_error(ErrorCode::not_found, "/proc/cpuinfo does not tell of core ", core);
    QDUINO_TRY_ASSIGN(LocalApicPage page, LocalApicPage::open(kKeepers, *own));
    QDUINO_TRY(posix::write_small_file(file, "0"));
    return GivenCore{core, *apic, std::move(page), std::move(lock)};
}

GivenCore::GivenCore(GivenCore&& other) noexcept
    : core_(std::exchange(other.core_, -1)),
      apic_number_(other.apic_number_),
      apic_(std::move(other.apic_)),
      lock_(std::move(other.lock_)) {}

GivenCore::~GivenCore() {
    if (const Result<void> given = give_back(); !given) say(given.error().message.view(), "qduino: ");
}

void GivenCore::start(std::uint32_t page) { apic_.start(apic_number_, page); }

Result<void> GivenCore::give_back() {
    const int core = std::exchange(core_, -1);
    if (core < 0) return {};
    apic_.park(apic_number_);
    return posix::write_small_file(online_file(core), "1");
}

}  // namespace qduino::apps::beside_linux
