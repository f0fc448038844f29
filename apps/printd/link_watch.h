// The spool's way to the sketch's link: finds it by its path, and finds it again when the sketch
// was started anew.
#pragma once

#include <filesystem>
#include <string>

#include "apps/link/link_file.h"
#include "spool/link_source.h"

namespace qduino::printd {

class LinkWatch final : public spool::LinkSource {
  public:
    explicit LinkWatch(std::filesystem::path path) : path_(std::move(path)) {}

    printer::link::LinkLayout* current() override { return file_.get(); }
    /// A path that names nothing replaces nothing: the mapped link stays until there is a newer
    /// one.
    bool is_replaced() override {
        if (!file_) return std::filesystem::exists(path_, ignored_);
        return std::filesystem::exists(path_, ignored_) && !file_.is_current(path_);
    }
    void reopen() override {
        file_ = {};
        Result<apps::LinkFile> opened = apps::open_link(path_);
        if (opened.ok()) {
            file_ = std::move(*opened);
            trouble_.clear();
        } else if (opened.error().code != ErrorCode::not_found) {
            trouble_ = opened.error().message.view();
        }
    }
    /// Why the link cannot be used although it is there; empty when it can.
    [[nodiscard]] const std::string& trouble() const { return trouble_; }

  private:
    std::filesystem::path path_;
    apps::LinkFile file_;
    std::string trouble_;
    std::error_code ignored_;
};

}  // namespace qduino::printd
