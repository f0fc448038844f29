// The files through which the programs of a computer meet, with any bytes in them: what is promised
// on its cores, and what interrupts take of them.
//
// Properties: what is read can be written, and nothing of it is lost or added then; what interrupts
// take is within what admission can count.
#include <cstdint>

#include "board/linux/computer/core_promises.h"
#include "board/linux/computer/interference_memory.h"
#include "tests/fuzz/gcode/fuzz_check.h"

namespace {

using namespace qduino;
using namespace qduino::board::linux;

void try_promise(std::string_view bytes) {
    const Promise first = read_promise(bytes);
    const Promise again = read_promise(promise_text(first));
    FUZZ_EXPECT(again.vcpus.size() == first.vcpus.size() && again.takers.size() == first.takers.size());
    FUZZ_EXPECT(again.trees.size() == first.trees.size() && again.groups.size() == first.groups.size());
}

void try_memory(std::string_view bytes) {
    InterferenceMemory memory = InterferenceMemory::parse(bytes);
    FUZZ_EXPECT(memory.size() <= InterferenceMemory::kLooks);
    const std::string written = memory.text();
    FUZZ_EXPECT(InterferenceMemory::parse(written).text() == written);
    const sched::PlatformInterferer counted = memory.interference().counted();
    FUZZ_EXPECT(counted.cost <= Nanoseconds{0} || counted.interval >= counted.cost);
    FUZZ_EXPECT(counted.interference(sched::kPeriodMax) >= Nanoseconds{0});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view bytes{reinterpret_cast<const char*>(data), size};
    try_promise(bytes);
    try_memory(bytes);
    return 0;
}
