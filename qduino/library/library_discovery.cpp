#include "qduino/library/library_discovery.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <set>
#include <system_error>
#include <thread>

#include "base/parts.h"
#include "posix/small_file.h"
#include "qduino/common/build_step.h"
#include "qduino/common/source_files.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

bool is_within(const fs::path& path, const fs::path& folder) {
    const auto [in_folder, in_path] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
    return in_folder == folder.end();
}

class Discovery {
  public:
    Discovery(const LibraryShelf& shelf, const CompileCommands& commands,
              const std::vector<fs::path>& sources, const fs::path& folder)
        : shelf_(shelf), commands_(commands), sources_(sources), folder_(folder) {}

    Result<DiscoveredLibraries> run() {
        recall();
        QDUINO_TRY(find_all());
        if (remembered_ > 0 && reached() < chosen_.size()) {
            forget();
            QDUINO_TRY(find_all());
        }
        QDUINO_TRY(remember());
        return DiscoveredLibraries{.libraries = chosen_, .notes = notes()};
    }

  private:
    [[nodiscard]] fs::path memory() const { return folder_ / "libraries"; }

    /// The libraries of the last time, unless one of their headers now means another library.
    void recall() {
        const std::string text = text_of(memory());
        for (std::string_view lines = text; !lines.empty();) {
            std::string_view folder = cut(lines, '\n');
            const std::string header{cut(folder, '\t')};
            const std::vector<Library> found = shelf_.having(header);
            if (found.empty() || found.front().folder != folder) return forget();
            choose(header, found.front());
        }
        remembered_ = chosen_.size();
    }

    /// The records were made with the headers of the remembered libraries.
    void forget() {
        std::error_code failed;
        fs::remove_all(folder_, failed);
        chosen_.clear();
        headers_.clear();
        scanned_.clear();
        remembered_ = 0;
    }

    Result<void> remember() const {
        std::string text;
        for (std::size_t i = 0; i < chosen_.size(); ++i)
            text += headers_[i] + '\t' + chosen_[i].folder.string() + '\n';
        std::error_code failed;
        fs::create_directories(folder_, failed);
        return text == text_of(memory()) ? Result<void>{} : posix::write_file(memory(), text);
    }

    void choose(const std::string& header, const Library& library) {
        chosen_.push_back(library);
        headers_.push_back(header);
    }

    [[nodiscard]] std::vector<fs::path> all_sources() const {
        std::vector<fs::path> all = sources_;
        for (const Library& library : chosen_) {
            const std::vector<fs::path> more = library.sources();
            all.insert(all.end(), more.begin(), more.end());
        }
        return all;
    }

    [[nodiscard]] BuildStep step_for(const fs::path& source) const {
        BuildStep step{.title = "",
                       .command = {"env", "LC_ALL=C"},
                       .inputs = {source},
                       .output = folder_ / source.relative_path(),
                       .depfile = {}};
        step.output += ".d";
        step.depfile = step.output;
        append(step.command, commands_.for_source(source));
        append(step.command, {"-fdiagnostics-color=never", "-M", "-MF", step.output.string(), "-MQ", "it",
                              source.string()});
        step.unrecorded = include_words(chosen_);
        return step;
    }

    /// Until no source lacks a header that some library has.
    Result<void> find_all() {
        for (;;) {
            QDUINO_TRY_ASSIGN(const std::vector<std::string> missing, scan());
            const std::size_t before = chosen_.size();
            for (const std::string& header : missing) {
                const std::vector<Library> found = shelf_.having(header);
                const auto is_chosen = [&](const Library& other) {
                    return other.folder == found.front().folder;
                };
                if (!found.empty() && std::ranges::none_of(chosen_, is_chosen)) choose(header, found.front());
            }
            if (chosen_.size() == before) return {};
        }
    }

    /// Preprocesses what has not been yet. The headers that were missing, each once, in the order
    /// of the sources.
    Result<std::vector<std::string>> scan() {
        std::vector<fs::path> sources;
        for (const fs::path& source : all_sources()) {
            if (!scanned_.contains(source)) sources.push_back(source);
        }
        std::vector<Result<bool>> made(sources.size(), Result<bool>{true});
        boost::asio::thread_pool threads{std::max(1u, std::thread::hardware_concurrency())};
        for (std::size_t i = 0; i < sources.size(); ++i) {
            boost::asio::post(threads, [this, &source = sources[i], &result = made[i]] {
                const BuildStep step = step_for(source);
                if (!is_up_to_date(step)) result = run_step(step);
            });
        }
        threads.join();
        std::vector<std::string> missing;
        for (std::size_t i = 0; i < sources.size(); ++i) {
            if (!made[i]) return made[i].error();
            const std::string header =
                *made[i] ? "" : missing_header(text_of(step_for(sources[i]).output += ".log"));
            if (header.empty()) {
                scanned_.insert(sources[i]);  // or wrong in another way
            } else if (std::ranges::find(missing, header) == missing.end()) {
                missing.push_back(header);
            }
        }
        return missing;
    }

    /// How many of the chosen libraries the sketch's sources lead to.
    [[nodiscard]] std::size_t reached() const {
        std::vector<fs::path> queue = sources_;
        std::set<fs::path> libraries;
        while (!queue.empty()) {
            const std::vector<fs::path> read = dependencies_in(text_of(step_for(queue.back()).depfile));
            queue.pop_back();
            for (const Library& library : chosen_) {
                const auto is_in = [&](const fs::path& file) { return is_within(file, library.folder); };
                if (libraries.contains(library.folder) || std::ranges::none_of(read, is_in)) continue;
                libraries.insert(library.folder);
                const std::vector<fs::path> more = library.sources();
                queue.insert(queue.end(), more.begin(), more.end());
            }
        }
        return libraries.size();
    }

    [[nodiscard]] std::vector<std::string> notes() const {
        std::vector<std::string> notes;
        for (std::size_t i = remembered_; i < chosen_.size(); ++i) {
            const Library& library = chosen_[i];
            const std::vector<Library> found = shelf_.having(headers_[i]);
            for (std::size_t other = 1; other < found.size(); ++other) {
                notes.push_back(headers_[i] + " is taken from " + library.folder.string() +
                                ", and not from " + found[other].folder.string());
            }
            if (library.runs_on(kArchitecture)) continue;
            std::string boards;
            for (const std::string& name : library.architectures)
                boards += (boards.empty() ? "" : ", ") + name;
            notes.push_back(library.name + " says that it is for " + boards +
                            " alone; it is tried here all the same");
        }
        return notes;
    }

    const LibraryShelf& shelf_;
    const CompileCommands& commands_;
    const std::vector<fs::path>& sources_;
    const fs::path folder_;
    std::vector<Library> chosen_;
    std::vector<std::string> headers_;  // by which each was found
    std::set<fs::path> scanned_;
    std::size_t remembered_ = 0;  // the first so many of `chosen_` are of the last time
};

}  // namespace

const Words& CompileCommands::for_source(const fs::path& source) const {
    const SourceKind kind = kind_of(source);
    return kind == SourceKind::cpp ? cpp : kind == SourceKind::c ? c : assembler;
}

Words include_words(const std::vector<Library>& libraries) {
    Words words;
    for (const Library& library : libraries) {
        for (const fs::path& folder : library.include_folders()) append(words, {"-isystem", folder.string()});
    }
    return words;
}

std::string missing_header(std::string_view log) {
    // g++: "fatal error: HEADER: No such file or directory"; clang: "fatal error: 'HEADER' file not
    // found".
    constexpr std::string_view kFatal = "fatal error: ";
    const std::size_t at = log.find(kFatal);
    if (at == std::string_view::npos) return {};
    std::string_view words = log.substr(at + kFatal.size());
    words = words.substr(0, words.find('\n'));
    const std::size_t end = words.find(": No such file or directory");
    if (end != std::string_view::npos) return std::string(words.substr(0, end));
    const std::size_t close = words.find("' file not found");
    return words.starts_with('\'') && close != std::string_view::npos
               ? std::string(words.substr(1, close - 1))
               : "";
}

Result<DiscoveredLibraries> discover_libraries(const LibraryShelf& shelf, const CompileCommands& commands,
                                               const std::vector<fs::path>& sources, const fs::path& folder) {
    // Where there are no libraries, nothing needs to be read twice.
    if (shelf.empty()) return DiscoveredLibraries{};
    return Discovery(shelf, commands, sources, folder).run();
}

}  // namespace qduino::apps
