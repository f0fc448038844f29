#include "apps/launcher/sketch_report.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>

#include "apps/launcher/run_log.h"
#include "base/parts.h"
#include "base/text.h"
#include "posix/system_error.h"

namespace qduino::launcher {
namespace {

constexpr std::size_t kMost = 64 * 1024;
constexpr std::size_t kLineMost = 120;

}  // namespace

SketchWords read_sketch_words(std::string_view text) {
    const std::string plain = plain_lines(text);
    std::string_view rest = plain;
    SketchWords words;
    words.where = cut(rest, '\n').substr(0, kLineMost);
    words.guarantees = cut(rest, '\n').substr(0, kLineMost);
    static_cast<void>(cut(rest, '\n'));
    words.rest = rest;
    return words;
}

Result<SketchReport> SketchReport::make() {
    SketchReport report;
    report.file_.reset(::memfd_create("sketch-report", MFD_CLOEXEC));
    if (!report.file_.valid()) return posix::system_error("make", "a file in memory");
    return report;
}

std::string SketchReport::path() const { return text<std::string>("/proc/self/fd/", file_.get()); }

void SketchReport::hand_on() const { ::fcntl(file_.get(), F_SETFD, 0); }

void SketchReport::clear() const { static_cast<void>(!::ftruncate(file_.get(), 0)); }

SketchWords SketchReport::read() const {
    std::string bytes(kMost, '\0');
    const ssize_t got = file_.valid() ? ::pread(file_.get(), bytes.data(), bytes.size(), 0) : 0;
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return read_sketch_words(bytes);
}

}  // namespace qduino::launcher
