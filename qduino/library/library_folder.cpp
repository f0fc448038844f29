#include "qduino/library/library_folder.h"

#include <algorithm>
#include <cctype>
#include <system_error>

#include "base/parts.h"
#include "posix/small_file.h"
#include "qduino/common/sdk.h"
#include "qduino/common/source_files.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProperties = "library.properties";

bool is_header(const fs::path& path) {
    const fs::path extension = path.extension();
    return extension == ".h" || extension == ".hpp" || extension == ".hh";
}

bool is_folder(const fs::path& path) {
    std::error_code failed;
    return fs::is_directory(path, failed);
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r";
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

/// "avr, samd" as its parts; what stands in parentheses ("Servo (>=1.2)") is left out.
std::vector<std::string> listed(std::string_view list) {
    std::vector<std::string> names;
    for (const std::string_view part : parts(list, ",")) {
        const std::string_view name = trimmed(part.substr(0, part.find('(')));
        if (!name.empty()) names.emplace_back(name);
    }
    return names;
}

}  // namespace

std::map<std::string, std::string> library_properties(std::string_view text) {
    std::map<std::string, std::string> values;
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte order mark
    while (!text.empty()) {
        const std::string_view line = trimmed(cut(text, '\n'));
        const std::size_t equals = line.find('=');
        if (!line.starts_with('#') && equals != std::string_view::npos)
            values[std::string(trimmed(line.substr(0, equals)))] =
                without_controls(trimmed(line.substr(equals + 1)));
    }
    return values;
}

std::string without_controls(std::string_view text) {
    std::string plain{text};
    for (std::size_t i = 0; i < plain.size(); ++i) {
        const auto c = static_cast<unsigned char>(plain[i]);
        const bool c1 =
            c == 0xc2 && i + 1 < plain.size() && (plain[i + 1] & 0xe0) == 0x80;  // U+0080 to U+009F
        if (c1) plain.replace(i, 2, "  ");
        if (c < 0x20 || c == 0x7f) plain[i] = ' ';
    }
    return plain;
}

bool is_harmless_flag(std::string_view flag) {
    const auto is_plain = [](std::string_view name) {
        return !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
            return std::isalnum(c) != 0 ||
                   std::string_view{"_+-./"}.find(static_cast<char>(c)) != std::string_view::npos;
        });
    };
    if (flag == "-pthread" || flag == "-s" || flag == "-Wl,--gc-sections") return true;
    return (flag.starts_with("-l") || flag.starts_with("-L")) && is_plain(flag.substr(2));
}

std::vector<fs::path> Library::include_folders() const {
    std::vector<fs::path> folders{code};
    if (!recursive && is_folder(code / "utility")) folders.push_back(code / "utility");
    return folders;
}

std::vector<fs::path> Library::sources() const {
    if (recursive) return sources_in(code, Depth::whole_tree);
    std::vector<fs::path> sources = sources_in(code, Depth::this_folder);
    const std::vector<fs::path> utility = sources_in(code / "utility", Depth::this_folder);
    sources.insert(sources.end(), utility.begin(), utility.end());
    return sources;
}

std::vector<std::string> Library::headers() const {
    if (!includes.empty()) return includes;
    std::vector<std::string> names;
    for (const fs::path& header : files_in(code, Depth::this_folder, is_header))
        names.push_back(header.filename().string());
    return names;
}

bool Library::runs_on(std::string_view architecture) const {
    const auto is_it = [&](const std::string& word) { return word == "*" || word == architecture; };
    return architectures.empty() || std::any_of(architectures.begin(), architectures.end(), is_it);
}

std::optional<Library> read_library(const fs::path& folder) {
    Library library;
    library.name = without_controls(folder.filename().string());
    library.folder = library.code = folder;
    const auto read = posix::read_small_file(folder / kProperties);
    if (!read) {
        if (files_in(folder, Depth::this_folder, is_header).empty()) return std::nullopt;
        return library;
    }
    std::map<std::string, std::string> said = library_properties(*read);
    if (!said["name"].empty()) library.name = said["name"];
    library.recursive = is_folder(folder / "src");
    if (library.recursive) library.code = folder / "src";
    library.version = said["version"];
    library.sentence = said["sentence"];
    library.architectures = listed(said["architectures"]);
    library.includes = listed(said["includes"]);
    library.depends = listed(said["depends"]);
    library.ldflags = words_of(said["ldflags"]);
    library.compiled_elsewhere = said["precompiled"] == "full";
    return library;
}

std::vector<Library> libraries_in(const fs::path& place) {
    std::vector<fs::path> folders;
    std::error_code missing;
    for (fs::directory_iterator entry(place, missing); !missing && entry != fs::directory_iterator{};
         entry.increment(missing)) {
        const fs::path& path = entry->path();
        if (!path.filename().string().starts_with(".") && is_folder(path)) folders.push_back(path);
    }
    std::sort(folders.begin(), folders.end());
    std::vector<Library> libraries;
    for (const fs::path& folder : folders) {
        if (std::optional<Library> library = read_library(folder)) libraries.push_back(std::move(*library));
    }
    return libraries;
}

}  // namespace qduino::apps
