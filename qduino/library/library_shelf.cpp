#include "qduino/library/library_shelf.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <system_error>
#include <tuple>

#include "base/parts.h"
#include "terminal/did_you_mean.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> folders_of(const std::string& list) {
    const std::vector<std::string_view> named = parts(list, ":");
    return {named.begin(), named.end()};
}

/// As names are compared: "Adafruit GFX Library" is adafruit_gfx_library.
std::string simple(const std::string& name) {
    std::string out;
    for (const char c : name) {
        const auto byte = static_cast<unsigned char>(c);
        const bool kept = std::isalnum(byte) || c == '.' || c == '-';
        out += kept ? static_cast<char>(std::tolower(byte)) : '_';
    }
    return out;
}

/// This user's, or root's. A sketch in /tmp must not be built with what another user has put into
/// /tmp/libraries.
bool is_ours(const fs::path& folder) {
    struct stat status {};
    return ::stat(folder.c_str(), &status) == 0 && (status.st_uid == ::geteuid() || status.st_uid == 0);
}

bool leads_out(const fs::path& header) {
    return header.is_absolute() || std::ranges::find(header, fs::path{".."}) != header.end();
}

bool has(const Library& library, const std::string& header) {
    std::error_code failed;
    const std::vector<fs::path> folders = library.include_folders();
    return std::ranges::any_of(
        folders, [&](const fs::path& folder) { return fs::is_regular_file(folder / header, failed); });
}

}  // namespace

Result<fs::path> user_libraries(const std::string& qduino_libraries, const std::string& home) {
    const std::vector<fs::path> named = folders_of(qduino_libraries);
    if (!named.empty()) return named.front();
    if (!home.empty()) return fs::path(home) / "Arduino" / "libraries";
    return make_error(ErrorCode::not_found, "no folder for libraries: set HOME, or QDUINO_LIBRARIES");
}

int likeness(const Library& library, const std::string& header) {
    const std::string wanted = simple(fs::path(header).stem().string());
    const std::string names[] = {simple(library.name), simple(library.folder.filename().string())};
    const auto any = [&](auto test) { return test(names[0]) || test(names[1]); };
    const auto is = [](const std::string& text) {
        return [text](const std::string& name) { return name == text; };
    };
    if (names[0] == wanted && names[1] == wanted) return 7;
    if (any(is(wanted))) return 6;
    if (any(is(wanted + "-main"))) return 5;
    if (any(is(wanted + "-master"))) return 4;
    if (any([&](const std::string& name) { return name.starts_with(wanted); })) return 3;
    if (any([&](const std::string& name) { return name.ends_with(wanted); })) return 2;
    return any([&](const std::string& name) { return name.find(wanted) != std::string::npos; }) ? 1 : 0;
}

LibraryShelf::LibraryShelf(const Sketch& sketch, const std::string& qduino_libraries,
                           const std::string& home) {
    add(sketch.folder / "libraries", true);
    const fs::path parent = sketch.folder.parent_path();
    // An example of a library that lies anywhere: Foo/examples/Demo.
    if (parent.filename() == "examples") {
        if (auto around = read_library(parent.parent_path())) add({std::move(*around)}, true);
    }
    for (const fs::path& beside : {parent / "libraries", parent.parent_path() / "libraries"}) {
        if (is_ours(beside)) add(beside, false);
    }
    for (const fs::path& folder : folders_of(qduino_libraries)) add(folder, false);
    if (!home.empty()) add(fs::path(home) / "Arduino" / "libraries", false);
}

void LibraryShelf::add(const fs::path& folder, bool own) {
    std::error_code failed;
    const fs::path place = fs::canonical(folder, failed);
    if (failed || std::ranges::find(seen_, place) != seen_.end()) return;
    seen_.push_back(place);
    add(libraries_in(place), own);
}

void LibraryShelf::add(std::vector<Library> libraries, bool own) {
    if (!libraries.empty()) places_.push_back({.own = own, .libraries = std::move(libraries)});
}

std::vector<Library> LibraryShelf::having(const std::string& header) const {
    struct Candidate {
        std::tuple<bool, bool, int, bool, std::size_t, int> merits;  // the greater is meant
        Library library;
    };
    if (leads_out(header)) return {};
    const std::string stem = simple(fs::path(header).stem().string());
    std::vector<Candidate> found;
    for (std::size_t i = 0; i < places_.size(); ++i) {
        for (const Library& library : places_[i].libraries) {
            const auto is_known = [&](const Candidate& other) {
                return other.library.folder == library.folder;
            };
            if (!has(library, header) || std::ranges::any_of(found, is_known)) continue;
            const bool optimised =
                std::ranges::find(library.architectures, kArchitecture) != library.architectures.end();
            const int difference = edit_distance(simple(library.folder.filename().string()), stem);
            found.push_back({{places_[i].own, library.runs_on(kArchitecture), likeness(library, header),
                              optimised, places_.size() - i, -difference},
                             library});
        }
    }
    // What is alike stays in the order of the alphabet.
    std::ranges::stable_sort(found, [](const auto& a, const auto& b) { return a.merits > b.merits; });
    std::vector<Library> libraries;
    for (Candidate& candidate : found) libraries.push_back(std::move(candidate.library));
    return libraries;
}

}  // namespace qduino::apps
