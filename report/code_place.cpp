#include "report/code_place.h"

#if QDUINO_HAVE_BACKTRACE
#include <backtrace.h>
#endif

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/text.h"

namespace qduino::apps {
namespace {

struct Line {
    std::string file;
    int number = 0;
    [[nodiscard]] bool in_sketch() const { return file.ends_with(".ino") || file.ends_with(".pde"); }
};

#if QDUINO_HAVE_BACKTRACE
/// The lines of one address: those of inlined functions first.
std::vector<Line> lines_of(const void* address) {
    static backtrace_state* const state = backtrace_create_state(
        nullptr, 0, [](void*, const char*, int) {}, nullptr);
    std::vector<Line> lines;
    const auto keep = [](void* into, std::uintptr_t, const char* file, int line, const char*) {
        if (file && line > 0)
            static_cast<std::vector<Line>*>(into)->push_back(
                {std::filesystem::path(file).filename().string(), line});
        return 0;
    };
    if (state)
        backtrace_pcinfo(
            state, reinterpret_cast<std::uintptr_t>(address), keep, [](void*, const char*, int) {}, &lines);
    return lines;
}
#else
std::vector<Line> lines_of(const void*) { return {}; }
#endif

}  // namespace

std::string place_of(std::span<const void* const> stack) {
    Line inner;
    for (const void* address : stack) {
        // A return address is behind the call: its line is that of the byte before.
        for (const Line& line : lines_of(static_cast<const char*>(address) - 1)) {
            if (inner.number == 0) inner = line;
            if (!line.in_sketch()) continue;
            const std::string place = text<std::string>(line.file, ':', line.number);
            if (inner.in_sketch()) return place;
            return text<std::string>(inner.file, ':', inner.number, ", called at ", place);
        }
    }
    if (inner.number == 0) return "an unknown place";
    return text<std::string>(inner.file, ':', inner.number);
}

}  // namespace qduino::apps
