// qduino lib: installs, lists, removes and looks for Arduino libraries.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "posix/small_file.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "qduino/library/library_index.h"
#include "qduino/library/library_shelf.h"
#include "qduino/library/library_store.h"
#include "terminal/human.h"
#include "terminal/message.h"
#include "terminal/parser.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// Where Arduino's index is. $QDUINO_LIBRARY_INDEX names another: a URL, or a file.
constexpr const char* kIndexUrl = "https://downloads.arduino.cc/libraries/library_index.json";
constexpr std::uint64_t kIndexMax = 512u << 20;
constexpr std::chrono::hours kIndexLasts{24};

std::string index_url() {
    const char* named = std::getenv("QDUINO_LIBRARY_INDEX");
    const std::string url = named && *named ? named : kIndexUrl;
    return url.find("://") == std::string::npos ? "file://" + fs::absolute(url).string() : url;
}

bool is_fresh(const fs::path& file) {
    std::error_code failed;
    const fs::file_time_type made = fs::last_write_time(file, failed);
    return !failed && fs::file_time_type::clock::now() - made < kIndexLasts;
}

/// The index: Arduino's is kept for a day, and for as long as a newer one cannot be had.
Result<LibraryIndex> fetch_index() {
    const std::string url = index_url();
    QDUINO_TRY_ASSIGN(const fs::path cache, cache_root(environment_of_this_process()));
    std::error_code failed;
    fs::create_directories(cache, failed);
    const fs::path kept = cache / "library_index.json";
    const bool is_arduinos = url == kIndexUrl;
    fs::path fetched = kept;
    fetched += ".new";
    Result<void> got;
    if (!is_arduinos || !is_fresh(kept)) got = download(url, fetched, kIndexMax);
    if (!got && !(is_arduinos && fs::exists(kept))) return got.error();
    if (!got)
        say("the index of libraries is an old one: " + std::string(got.error().message.view()) + "\n",
            "qduino: ");
    const bool is_new = got.ok() && fs::exists(fetched);
    QDUINO_TRY_ASSIGN(const std::string text, posix::read_small_file(is_new ? fetched : kept));
    const Result<LibraryIndex> index = LibraryIndex::read(text);
    if (is_new && index && is_arduinos) fs::rename(fetched, kept, failed);
    fs::remove(fetched, failed);
    return index;
}

void say_installed(const Library& library) {
    std::printf("%s\n", library.folder.c_str());
    std::fflush(stdout);
    std::string headers;
    for (const std::string& header : library.headers()) headers += " <" + header + ">";
    say("library " + library.name + (library.version.empty() ? "" : " " + library.version) +
        " is installed; include" + headers + "\n");
}

/// What a word on the command line means.
enum class Origin { folder, zip, remote_zip, git, index };

Origin origin_of(const std::string& word) {
    const std::string plain = word.substr(0, word.find('#'));
    const bool remote = plain.find("://") != std::string::npos;
    if (plain.ends_with(".git") || plain.starts_with("git@") || plain.starts_with("git:") ||
        plain.starts_with("ssh:"))
        return Origin::git;
    if (remote) return plain.ends_with(".zip") ? Origin::remote_zip : Origin::git;
    std::error_code failed;
    if (fs::is_directory(word, failed)) return Origin::folder;
    return plain.ends_with(".zip") || fs::is_regular_file(word, failed) ? Origin::zip : Origin::index;
}

/// Installs `name`, or "name@version", and what it depends on, unless it is installed.
Result<void> install_from_index(const LibraryStore& store, const std::string& word) {
    QDUINO_TRY_ASSIGN(const LibraryIndex index, fetch_index());
    const std::size_t at = std::min(word.find('@'), word.size());
    const std::string name = word.substr(0, at), version = at < word.size() ? word.substr(at + 1) : "";
    std::vector<const IndexedLibrary*> wanted{index.find(name, version)};
    if (!wanted[0]) {
        const std::string guess = index.nearest_name(name);
        return make_error(ErrorCode::not_found,
                          "no such library in the index, and no such folder or zip: ", word,
                          guess.empty() ? std::string{} : ". Did you mean " + guess + "?");
    }
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        for (const std::string& needed : wanted[i]->depends) {
            const auto has_name = [&](const IndexedLibrary* other) { return other->name == needed; };
            if (store.find(needed) || std::ranges::any_of(wanted, has_name)) continue;
            const IndexedLibrary* found = index.find(needed);
            if (!found)
                return make_error(ErrorCode::not_found, "the index lacks a library that it needs: ", needed);
            wanted.push_back(found);
        }
    }
    // What is needed comes first: the library that was asked for is whole when it is there.
    for (auto one = wanted.rbegin(); one != wanted.rend(); ++one) {
        const ArchiveFacts facts{.size = (*one)->size, .sha256 = (*one)->sha256};
        QDUINO_TRY_ASSIGN(const Library library, store.add_download((*one)->url, facts));
        say_installed(library);
    }
    return {};
}

Result<void> install(const LibraryStore& store, const std::string& word) {
    const Origin origin = origin_of(word);
    if (origin == Origin::index) return install_from_index(store, word);
    const Result<Library> library = origin == Origin::folder ? store.add_folder(word)
                                    : origin == Origin::zip  ? store.add_zip(word)
                                    : origin == Origin::git  ? store.add_git(word)
                                                             : store.add_download(word, {});
    if (!library) return library.error();
    say_installed(*library);
    return {};
}

Result<void> search(const std::vector<std::string>& words) {
    QDUINO_TRY_ASSIGN(const LibraryIndex index, fetch_index());
    const std::vector<const IndexedLibrary*> found = index.search(words);
    for (const IndexedLibrary* library : found)
        std::printf("%s@%s\n    %s\n", library->name.c_str(), library->version.c_str(),
                    library->sentence.c_str());
    std::fflush(stdout);
    say(verdict(counted(static_cast<long long>(found.size()), "library").append(" found.")));
    return {};
}

void list(const fs::path& folder) {
    for (const Library& library : libraries_in(folder)) {
        std::string headers;
        for (const std::string& header : library.headers()) headers += " <" + header + ">";
        std::printf("%s %s %s%s\n", column(library.name, -24).c_str(), column(library.version, -8).c_str(),
                    library.folder.c_str(), headers.c_str());
    }
    std::fflush(stdout);
}

class Lib final : public Command {
    void declare(CLI::App& app) override {
        add_option(app, "action", action_, "install, list, remove or search", "ACTION")
            ->required()
            ->check(CLI::IsMember({"install", "list", "remove", "search"}));
        add_option(app, "what", words_, "Libraries, or words to look for", "[WHAT...]");
    }

    Result<int> run() override {
        QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
        const BuildEnvironment environment = environment_of_this_process();
        QDUINO_TRY_ASSIGN(const fs::path folder,
                          user_libraries(environment.qduino_libraries, environment.home));
        const LibraryStore store(fs::absolute(folder), {.python = sdk.python, .unpack_zip = sdk.unpack_zip});
        if (action_ == "list") {
            list(fs::absolute(folder));
            return 0;
        }
        if (words_.empty())
            return make_error(ErrorCode::invalid_argument, "'qduino lib ", action_,
                              "' needs to know which: a name",
                              action_ == "install" ? ", a folder, a zip or a git URL" : "");
        if (action_ == "search") {
            QDUINO_TRY(search(words_));
            return 0;
        }
        for (const std::string& word : words_) {
            if (action_ == "install") {
                QDUINO_TRY(install(store, word));
                continue;
            }
            QDUINO_TRY_ASSIGN(const Library removed, store.remove(word));
            say("library " + removed.name + " is removed from " + folder.string() + "\n");
        }
        return 0;
    }

    std::string action_;
    std::vector<std::string> words_;
};

const Listed<Lib> lib_listed{{Place::lib, "lib", "Install Arduino libraries",
                              "Into the first folder of QDUINO_LIBRARIES, else ~/Arduino/libraries, where\n"
                              "every sketch finds them by the headers that it includes. 'install' takes a\n"
                              "folder, a zip, a git URL (URL#TAG), or NAME or NAME@VERSION of Arduino's\n"
                              "index, with what it depends on; SHA-256 is verified. 'search' looks for\n"
                              "words in the index.\n"
                              "Example: qduino lib install Bounce2"}};

}  // namespace
}  // namespace qduino::apps
