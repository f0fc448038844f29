#include "inspect/prefetch_source.h"

#include <chrono>
#include <filesystem>
#include <vector>

namespace qduino::apps {

PrefetchSource::PrefetchSource(const std::string& path) : ring_(std::make_unique<Ring>()) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) file_.open(path, std::ios::binary);
    ok_ = file_.is_open();
    if (ok_) {
        reader_ = std::thread([this] { read_ahead(); });
    } else {
        ended_ = true;
    }
}

PrefetchSource::~PrefetchSource() {
    stop_ = true;
    if (reader_.joinable()) reader_.join();
}

void PrefetchSource::read_ahead() {
    std::vector<char> piece(std::size_t{1} << 16);
    while (!stop_) {
        file_.read(piece.data(), static_cast<std::streamsize>(piece.size()));
        const auto count = static_cast<std::size_t>(file_.gcount());
        if (count == 0) break;
        while (!ring_->try_push_all({piece.data(), count})) {
            if (stop_) return;
            std::this_thread::sleep_for(std::chrono::milliseconds{5});
        }
    }
    ended_ = true;
}

std::size_t PrefetchSource::read(std::span<char> into) {
    for (;;) {
        // Read first: everything that was pushed before the end is then in the ring.
        const bool ended = ended_;
        const std::size_t count = ring_->pop_some(into);
        if (count != 0 || ended || into.empty()) return count;
        std::this_thread::sleep_for(std::chrono::microseconds{100});
    }
}

}  // namespace qduino::apps
