#include "qduino/common/build_step.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdio>
#include <mutex>
#include <optional>
#include <regex>
#include <system_error>
#include <thread>

#include "posix/small_file.h"
#include "qduino/common/child_process.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

fs::path beside(const fs::path& output, const char* extension) {
    fs::path path = output;
    path += extension;
    return path;
}

/// Every word on a line of its own: none of them has a newline that would matter.
std::string record_of(const BuildStep& step) {
    std::string record;
    for (const std::string& word : step.command) record += word + '\n';
    for (const fs::path& input : step.inputs) record += input.string() + '\n';
    return record;
}

bool older_than(const fs::path& path, fs::file_time_type limit) {
    std::error_code failed;
    const fs::file_time_type changed = fs::last_write_time(path, failed);
    return !failed && changed < limit;
}

void say_log(const BuildStep& step) {
    const std::string log = text_of(beside(step.output, ".log"));
    std::fputs((::isatty(STDERR_FILENO) ? log : without_colours(log)).c_str(), stderr);
}

/// The steps of one run, worked off by some threads.
class Work {
  public:
    explicit Work(bool verbose) : verbose_(verbose) {}

    [[nodiscard]] Result<StepsDone> result() const {
        if (error_) return *error_;
        return done_;
    }

    void run(const BuildStep& step) {
        if (given_up_) return;
        if (is_up_to_date(step)) {
            const std::lock_guard lock{speaking_};
            return say_log(step);
        }
        {
            const std::lock_guard lock{speaking_};
            std::fprintf(stderr, "%s\n", step.title.c_str());
            if (verbose_) std::fprintf(stderr, "  %s\n", shell_words(step.command).c_str());
        }
        const Result<bool> made = run_step(step);
        const std::lock_guard lock{speaking_};
        if (made && !*made && step.may_fail) return;
        if (!made || !*made) given_up_ = true;
        if (!made) {
            if (!error_) error_ = made.error();
            return;
        }
        say_log(step);
        done_.made += 1;
        done_.failed = done_.failed || !*made;
    }

  private:
    bool verbose_;
    std::atomic<bool> given_up_{false};
    std::mutex speaking_;  // and what follows
    StepsDone done_;
    std::optional<Error> error_;
};

}  // namespace

std::string text_of(const fs::path& path) {
    const auto read = posix::read_small_file(path);
    return read ? *read : "";
}

std::vector<fs::path> dependencies_in(std::string_view depfile) {
    std::vector<fs::path> files;
    std::string word;
    const std::size_t colon = depfile.find(": ");
    if (colon == std::string_view::npos) return files;
    const auto end_word = [&] {
        if (!word.empty()) files.emplace_back(word);
        word.clear();
    };
    for (std::size_t i = colon + 1; i < depfile.size(); ++i) {
        const char c = depfile[i];
        const char next = i + 1 < depfile.size() ? depfile[i + 1] : '\0';
        if (c == '\\' && next == '\n') {
            end_word();
            ++i;
        } else if ((c == '\\' && (next == ' ' || next == '#' || next == '\\')) || (c == '$' && next == '$')) {
            word += next;
            ++i;
        } else if (c == '\n') {
            break;  // what follows are rules for headers alone (-MP)
        } else if (c == ' ') {
            end_word();
        } else {
            word += c;
        }
    }
    end_word();
    return files;
}

bool is_up_to_date(const BuildStep& step) {
    std::error_code failed;
    const fs::file_time_type made = fs::last_write_time(step.output, failed);
    if (failed || text_of(beside(step.output, ".cmd")) != record_of(step)) return false;
    const auto older = [&](const fs::path& path) { return older_than(path, made); };
    if (!std::all_of(step.inputs.begin(), step.inputs.end(), older)) return false;
    if (step.depfile.empty()) return true;
    const std::vector<fs::path> read = dependencies_in(text_of(step.depfile));
    return !read.empty() && std::all_of(read.begin(), read.end(), older);
}

std::string without_colours(std::string_view text) {
    static const std::regex kColour{"\033\\[[^@-~]*[@-~]?"};
    return std::regex_replace(std::string{text}, kColour, "");
}

Result<bool> run_step(const BuildStep& step) {
    std::error_code failed;
    fs::create_directories(step.output.parent_path(), failed);
    fs::remove(beside(step.output, ".cmd"), failed);
    const auto began = fs::file_time_type::clock::now();
    std::vector<std::string> command = step.command;
    command.insert(command.end(), step.unrecorded.begin(), step.unrecorded.end());
    QDUINO_TRY_ASSIGN(const int status, run_into(command, beside(step.output, ".log")));
    if (status != 0) {
        fs::remove(step.output, failed);
        return false;
    }
    fs::last_write_time(step.output, began, failed);
    if (!failed && posix::write_file(beside(step.output, ".cmd"), record_of(step))) return true;
    return make_error(ErrorCode::unavailable,
                      "cannot write to the build folder (disk full?): ", step.output.native());
}

Result<StepsDone> run_steps(const std::vector<BuildStep>& steps, bool verbose) {
    Work work(verbose);
    boost::asio::thread_pool threads{std::max(1u, std::thread::hardware_concurrency())};
    for (const BuildStep& step : steps) boost::asio::post(threads, [&work, &step] { work.run(step); });
    threads.join();
    return work.result();
}

}  // namespace qduino::apps
